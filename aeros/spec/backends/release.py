"""Which release of the solver is installed, found without importing it."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

_WHEEL = "z3_solver"


@cache
def solver_release() -> str:
    """The version of the distribution `z3-solver` that `import z3` would import, as its metadata has it.

    The folder beside the package bears it in its name, where an installer wrote one and only one.
    `importlib.metadata` says the same and costs more to import than all else that a kept proof needs.
    """
    package = find_spec("z3")
    beside = () if package is None or package.origin is None else Path(package.origin).parents[1].iterdir()
    found = [one.name for one in beside if one.name.startswith(f"{_WHEEL}-") and one.suffix == ".dist-info"]
    if len(found) == 1:
        return found[0].removeprefix(f"{_WHEEL}-").removesuffix(".dist-info")
    from importlib.metadata import version

    return version("z3-solver")

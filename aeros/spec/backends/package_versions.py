"""Which release of a package is installed, found without importing it."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path


def z3_version() -> str:
    """The version of the distribution `z3-solver`, as its metadata has it."""
    return package_version("z3-solver", "z3")


@cache
def package_version(distribution: str, package: str) -> str:
    """The version of the distribution that `import package` would import, as its metadata has it.

    The folder beside the package bears it in its name, where an installer wrote one and only one.
    `importlib.metadata` says the same and costs more to import than all else that a kept proof needs.
    """
    spec = find_spec(package)
    beside = () if spec is None or spec.origin is None else Path(spec.origin).parents[1].iterdir()
    start = distribution.replace("-", "_").lower() + "-"
    found = [one.name for one in beside if one.name.lower().startswith(start) and one.suffix == ".dist-info"]
    if len(found) == 1:
        return found[0][len(start) :].removesuffix(".dist-info")
    from importlib.metadata import version

    return version(distribution)

"""The functions of this process, whose code a mutant replaces."""

from __future__ import annotations

import gc
import importlib
import sys
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from tests.mutation.mutants import CodeMutant, Unit

_Place = tuple[str, int]


class LiveFunctions:
    """Functions of some modules by file and first line, wherever they are referred to."""

    def __init__(self, modules: Iterable[str]) -> None:
        files = set(filter(None, map(_file_of, modules)))
        self._at: dict[_Place, list[FunctionType]] = defaultdict(list)
        gc.unfreeze()  # conftest.py hides objects from the collector
        for one in gc.get_objects():
            if isinstance(one, FunctionType) and one.__code__.co_filename in files:
                code = one.__code__
                self._at[code.co_filename, code.co_firstlineno].append(one)
        gc.collect()
        gc.freeze()

    def of(self, unit: Unit) -> list[FunctionType]:
        """Return the functions that run a unit's code."""
        if unit.module not in sys.modules:
            return []
        path = str(Path(str(sys.modules[unit.module].__file__)))
        name = unit.name.rpartition(".")[2]
        return [one for one in self._at.get((path, unit.line), []) if one.__code__.co_name == name]

    def can_run(self, unit: Unit) -> bool:
        """Tell if replacing code has an effect: outside of functions it has none."""
        return bool(unit.line and self.of(unit))

    def install(self, mutant: CodeMutant) -> None:
        """Replace the code of a mutant's function in this process.

        Raises:
            ValueError: the mutant needs other variables of the functions around it.
        """
        unit = mutant.unit
        new = _define(mutant.function(), unit)
        for function in self.of(unit):
            function.__code__ = new.__code__
            if mutant.in_signature:
                function.__defaults__ = new.__defaults__
                function.__kwdefaults__ = new.__kwdefaults__


def _file_of(module: str) -> str | None:
    """Import a module, and return its file; None if it needs what is not installed, such as ROS."""
    try:
        return importlib.import_module(module).__file__
    except ModuleNotFoundError:
        return None


def _define(code: CodeType, unit: Unit) -> FunctionType:
    """Run a definition among the names of its module, and return the function."""
    names = dict(vars(sys.modules[unit.module]))
    exec(code, names)  # noqa: S102 - a mutant of AEROS's own code
    found: Any = names[(*unit.classes, unit.node.name.value)[0]]
    for name in (*unit.classes, unit.node.name.value)[1:]:
        private = name.startswith("__") and not name.endswith("__")
        found = vars(found)[f"_{unit.classes[-1].lstrip('_')}{name}" if private else name]
    assert isinstance(found, FunctionType)
    return found

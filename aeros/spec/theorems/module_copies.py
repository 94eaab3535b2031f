"""Copies of modules as they ship, to be run with leaves that are symbolic, or broken on purpose.

A copy is compiled from the very source that is imported everywhere else.  What is put in place of one
of its names has to be a name of it, and what breaks it has to be found in it once: where the code has
changed so that either is no longer so, nothing is proved by habit.
"""

from __future__ import annotations

import ast
import builtins
import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from aeros.spec.diagnostics.errors import InternalError


@dataclass(frozen=True)
class Mutant:
    """Code that is deliberately wrong in one place; the theorem must not hold of it.

    name: what it does wrong, in a few words with hyphens.
    refutes: the obligation that must fail of it.
    module: the module of AEROS that it breaks.
    old, new: text that its source has exactly once, and what stands there instead.
    """

    name: str
    refuted_obligation: str
    module: str
    old: str
    new: str


class ModuleSource:
    """Where obligations get the code from that they are made of: as it ships, or as a mutant has it."""

    def __init__(self, mutant: Mutant | None = None) -> None:
        self._mutant = mutant
        self._compiled: dict[str, Any] = {}
        self.loaded: set[str] = set()

    def module(self, name: str, /, *, using: Sequence[ModuleType] = (), **stubs: Any) -> ModuleType:
        """A copy of the module `name`, fresh, with `stubs` in place of what bears their names in it.

        using: copies that it imports where it would import what they are copies of.
        stubs: builtins may be named, too.
        """
        self.loaded.add(name)
        copy = ModuleType(name)
        copy.__file__ = str(_path(name))
        vars(copy)["__builtins__"] = {**_BUILTINS, "__import__": _import_hook(using)}
        if name not in self._compiled:
            self._compiled[name] = compile(self._source(name), copy.__file__, "exec", dont_inherit=True)
        exec(self._compiled[name], vars(copy))  # noqa: S102 - it is AEROS's own code
        install_stubs(copy, stubs)
        return copy

    def _source(self, name: str) -> str:
        source = _path(name).read_text("utf-8")
        if self._mutant is None or self._mutant.module != name:
            return source
        found = source.count(self._mutant.old)
        if found != 1:
            raise InternalError(f"the mutant `{self._mutant.name}` does not apply: found {found} times")
        broken = source.replace(self._mutant.old, self._mutant.new)
        if ast.dump(ast.parse(broken)) == ast.dump(ast.parse(source)):
            raise InternalError(f"the mutant `{self._mutant.name}` changes nothing")
        return broken


def install_stubs(module: ModuleType, stubs: Mapping[str, Any]) -> None:
    """`stubs` in place of what bears their names in `module`, or of builtins."""
    for name, stub in stubs.items():
        if name not in vars(module) and name not in _BUILTINS:
            raise InternalError(f"`{module.__name__}` has no `{name}` any more that could be put aside")
        vars(module)[name] = stub


_BUILTINS: Mapping[str, Any] = vars(builtins)


def _import_hook(copies: Sequence[ModuleType]) -> Callable[..., Any]:
    """As `__import__`, with these in place of what they are copies of."""
    known = {copy.__name__: copy for copy in copies}

    def importing(name: str, *arguments: Any, **named: Any) -> Any:
        return known.get(name) or builtins.__import__(name, *arguments, **named)

    return importing


def _path(name: str) -> Path:
    """The source file of a module, which is imported: its copies say that they are it."""
    return Path(str(importlib.import_module(name).__file__))

"""Copies of shipped modules to run with symbolic stubs, or with a deliberate fault (mutants).

A copy is compiled from the same source that is imported everywhere else. A stub must replace an existing
name, and the text that a mutant replaces must occur exactly once. If the code has changed so that this no
longer holds, an error says so, and nothing is proved about code that no longer exists.
"""

from __future__ import annotations

import ast
import builtins
import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from aeros.spec.diagnostics.errors import InternalError


@dataclass(frozen=True)
class Mutant:
    """Code that is deliberately wrong in one place; the theorem must fail for it.

    Attributes:
        name: the fault, in a few words with hyphens.
        refuted_obligation: obligation that must fail.
        module: module of AEROS that it changes.
        old: text that its source has exactly once.
        new: text that replaces it.
    """

    name: str
    refuted_obligation: str
    module: str
    old: str
    new: str


class ModuleSource:
    """Source of the modules that obligations are made from: as shipped, or with one mutant."""

    def __init__(self, mutant: Mutant | None = None) -> None:
        self._mutant = mutant
        self._compiled: dict[str, CodeType] = {}
        self.loaded: set[str] = set()

    def module(self, name: str, /, *, using: Sequence[ModuleType] = (), **stubs: Any) -> ModuleType:
        """Make a fresh copy of a module with stubs.

        Args:
            name: full name of the module.
            using: copies that it imports instead of the originals.
            **stubs: replacements of names of the module; builtins may be replaced, too.

        Returns:
            The copy.

        Raises:
            InternalError: a stub's name does not exist, or the mutant does not apply.
        """
        copy = ModuleType(name)
        copy.__file__ = str(_path(name))
        vars(copy)["__builtins__"] = {**_BUILTINS, "__import__": _import_hook(using)}
        if name not in self._compiled:
            self._compiled[name] = _compiled(self.source(name), copy.__file__)
        exec(self._compiled[name], vars(copy))  # noqa: S102 - it is AEROS's own code
        install_stubs(copy, stubs)
        return copy

    def source(self, name: str) -> str:
        """Return the source of a module, with the mutant if it is one of this module.

        Args:
            name: full name of the module.

        Returns:
            The text.

        Raises:
            InternalError: the mutant does not apply.
        """
        self.loaded.add(name)
        source = _path(name).read_text("utf-8")
        if self._mutant is None or self._mutant.module != name:
            return source
        found = source.count(self._mutant.old)
        if found != 1:
            raise InternalError(f"the mutant `{self._mutant.name}` does not apply: found {found} times")
        broken = source.replace(self._mutant.old, self._mutant.new)
        if _syntax(broken) == _syntax(source):
            raise InternalError(f"the mutant `{self._mutant.name}` changes nothing")
        return broken


@lru_cache(maxsize=1 << 8)
def _compiled(source: str, file: str) -> CodeType:
    """Compile a module; mutants of other modules have the same source of this one."""
    return compile(source, file, "exec", dont_inherit=True)


@lru_cache(maxsize=1 << 6)
def _syntax(source: str) -> str:
    """Return the syntax tree of a module as text."""
    return ast.dump(ast.parse(source))


def install_stubs(module: ModuleType, stubs: Mapping[str, Any]) -> None:
    """Replace names of a module, or builtins in it.

    Args:
        module: copy of a module.
        stubs: replacements by name.

    Raises:
        InternalError: the module has no such name.
    """
    for name, stub in stubs.items():
        if name not in vars(module) and name not in _BUILTINS:
            raise InternalError(f"`{module.__name__}` has no `{name}` any more that could be put aside")
        vars(module)[name] = stub


_BUILTINS: Mapping[str, Any] = vars(builtins)


def _import_hook(copies: Sequence[ModuleType]) -> Callable[..., Any]:
    """Make an `__import__` that returns these copies instead of their originals."""
    known = {copy.__name__: copy for copy in copies}

    def importing(name: str, *arguments: Any, **named: Any) -> Any:
        return known.get(name) or builtins.__import__(name, *arguments, **named)

    return importing


def _path(name: str) -> Path:
    """Return the source file of a module; the module is imported for that."""
    return Path(str(importlib.import_module(name).__file__))

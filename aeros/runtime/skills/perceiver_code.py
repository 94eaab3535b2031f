"""Code of perceivers: executed with a list of names that it may import and of builtins that it may use.

The list keeps honest code from going astray, and is the one that the code was read against before it was
installed. It confines nobody: the layers of isolation do.
"""

from __future__ import annotations

import builtins
import importlib
from collections.abc import Callable, Collection, Generator, Mapping
from types import ModuleType
from typing import Any, NamedTuple

from aeros.runtime.skills.code import CodeFile
from aeros.skill import Models

PerceiverFunction = Callable[..., Generator[Any, Any, None]]
"""Generator function of a perceiver: takes the first view, and the models if the perceiver declares any."""


class PerceiverNames(NamedTuple):
    """Names that the code of perceivers may use.

    Attributes:
        members: members that it may import, by module.
        builtins: builtins that it may use.
    """

    members: Mapping[str, Collection[str]]
    builtins: Collection[str]


def execute_perceiver(code: CodeFile, function: str, names: PerceiverNames) -> PerceiverFunction:
    """Execute a file of perceivers, with the files that it imports, and return a generator function of it.

    Args:
        code: the file.
        function: name of the generator function.
        names: names that the code may use.

    Returns:
        The function, from a fresh execution of the file.

    Raises:
        SkillRefusedError: the code raises when loaded, or has no such generator function.
    """
    return code.generator_function(function, _guarded_builtins(names))


def start_perceiver(function: PerceiverFunction, view: object, models: Models) -> Generator[Any, Any, None]:
    """Start a perceiver, up to its first value.

    Args:
        function: its generator function.
        view: the first view.
        models: the models that the perceiver declares, by name; it takes them as a second argument if there
            are any.

    Returns:
        The generator, not started.
    """
    return function(view, models) if models else function(view)


def _guarded_builtins(names: PerceiverNames) -> dict[str, Any]:
    guarded = {name: getattr(builtins, name) for name in names.builtins}
    modules = {name: _guarded_module(name, names.members[name]) for name in names.members}
    for name, module in modules.items():
        parent, _, child = name.rpartition(".")
        if parent in modules and child in names.members[parent]:
            setattr(modules[parent], child, module)

    def import_allowed(
        name: str,
        namespace: object = None,
        local_names: object = None,
        members: Collection[str] | None = (),
        _: int = 0,  # `CodeFile` imports the other files of a module itself
    ) -> ModuleType:
        if type(members) is list and name.startswith("numpy."):
            # Not a statement, which passes a tuple: NumPy's own C code imports from within a call.
            return importlib.import_module(name)
        if name not in modules:
            raise ImportError(f"a perceiver may not import `{name}`")
        if members or "." not in name:
            return modules[name]
        raise ImportError(f"import the members of `{name}` by their names")

    # Statements compile to calls of these two.
    return {**guarded, "__import__": import_allowed, "__build_class__": builtins.__build_class__}


def _guarded_module(name: str, members: Collection[str]) -> ModuleType:
    """Make a module that has nothing but the allowed members, as far as the real one has them."""
    # Under its own name, `from numpy import lib` would find `numpy.lib` among the loaded modules.
    real, guarded = importlib.import_module(name), ModuleType(f"<{name}>")
    for member in members:
        if hasattr(real, member):
            setattr(guarded, member, getattr(real, member))
    return guarded

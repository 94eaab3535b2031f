"""Execution of a module's code from certified bytes: a file, and the files of the module that it imports.

Used wherever module code runs: in a worker, and in the runtime's own process for modules that the site
trusts. It imports very little, so that a worker holds very little.
"""

from __future__ import annotations

import builtins
import inspect
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from functools import lru_cache
from pathlib import PurePath
from types import CodeType, ModuleType
from typing import Any, Final, NamedTuple

from aeros.descriptions import describe_exception
from aeros.runtime.skills.contract import SkillRefusedError

ImportFunction = Callable[..., Any]
"""Takes what `builtins.__import__` takes."""

_PREFIX: Final = "_aeros_ecm_"


class CodeFile(NamedTuple):
    """A file of a module's code, and the files that it may import.

    Attributes:
        module: id of the module.
        name: path of the file in the module's folder.
        path: path of the file, for tracebacks.
        content: source code, whose digest was checked.
        neighbours: name and source code of each other file of the folder, of the same digest.
    """

    module: str
    name: str
    path: str
    content: bytes
    neighbours: tuple[tuple[str, bytes], ...] = ()

    def generator_function(
        self, function: str, names: Mapping[str, object] | None = None
    ) -> Callable[..., Generator[Any, Any, Any]]:
        """Execute the file afresh, with each file that it imports, and return a generator function of it.

        Args:
            function: name of the function.
            names: builtins of the code; None for Python's own.

        Returns:
            The function.

        Raises:
            SkillRefusedError: the code raises when loaded, or has no such generator function.
        """
        executed = _Execution(self, vars(builtins) if names is None else names).execute(
            self.name, self.path, self.content
        )
        generator = executed.__dict__.get(function)
        if not inspect.isgeneratorfunction(generator):
            raise SkillRefusedError(
                f"`{self.name}` of module `{self.module}` has no generator function `{function}`"
            )
        return generator


def is_code_of_same_module(namespace: Mapping[str, object], function: Callable[..., Any]) -> bool:
    """Tell if a namespace is that of a file that was executed for a function, or is its own.

    Args:
        namespace: global names of some code.
        function: function of module code.

    Returns:
        True if both are files of one module.
    """
    name, own = namespace.get("__name__"), function.__module__
    package = own.partition(".")[0]
    return name == own or (
        package.startswith(_PREFIX) and type(name) is str and name.startswith(f"{package}.")
    )


class _Execution:
    """One execution of a file and of what it imports, so that no two runs of module code share state.

    `sys.path` is left alone and each file gets a private name, so no other code can be loaded in its place.
    """

    def __init__(self, code: CodeFile, names: Mapping[str, object]) -> None:
        self._code = code
        self._names = names
        self._neighbours = dict(code.neighbours)
        self._executed: dict[str, ModuleType | None] = {code.name: None}  # None while it is executed

    def execute(self, name: str, path: str, content: bytes) -> ModuleType:
        """Execute a file under a private name.

        Raises:
            SkillRefusedError: the code raises when loaded.
        """
        module = self._code.module
        dotted = name.removesuffix(".py").replace("/", ".")
        executed = ModuleType(f"{_PREFIX}{module}.{dotted}")
        executed.__file__ = path
        executed.__dict__["__builtins__"] = {**self._names, "__import__": self._import}
        # Standard library code (dataclasses, pickle) looks up a class's module here.
        sys.modules[executed.__name__] = executed
        try:
            exec(_compile(content, path), executed.__dict__)  # noqa: S102 - what this file is for; digest checked
        except BaseException as failure:
            del sys.modules[executed.__name__]
            if isinstance(failure, KeyboardInterrupt | SkillRefusedError):
                raise
            raise SkillRefusedError(
                f"the code of module `{module}` fails to load: {describe_exception(failure)}"
            ) from failure
        self._executed[name] = executed
        return executed

    def _import(
        self,
        name: str,
        namespace: object = None,
        local_names: object = None,
        members: Sequence[str] | None = (),
        level: int = 0,
    ) -> Any:
        """Import as `builtins.__import__` does, but a neighbour from its certified bytes.

        Raises:
            ImportError: the module has no such file, or the file imports itself.
        """
        if level == 0:
            usual: Any = self._names["__import__"]
            return usual(name, namespace, local_names, members, level)
        file = f"{name}.py"
        if level != 1 or not members or file not in {*self._neighbours, self._code.name}:
            raise ImportError(f"module `{self._code.module}` has no file for `{'.' * level}{name}`")
        if file not in self._executed:
            self._executed[file] = None
            path = str(PurePath(self._code.path).with_name(file))
            return self.execute(file, path, self._neighbours[file])
        executed = self._executed[file]
        if executed is None:
            raise ImportError(f"`{file}` imports itself, directly or through other files")
        return executed


@lru_cache(maxsize=256)
def _compile(content: bytes, path: str) -> CodeType:
    return compile(content, path, "exec", dont_inherit=True)

"""Loads skill code: only the very bytes whose digest is the certified one are executed.

Runs in this process: skill code can reach whatever Python can.  What keeps it from acting is the
gate between it and the plant, not this loader; isolation in another process is a separate layer.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import CodeType, ModuleType

from aeros.runtime.canonical import type_name
from aeros.skill import Inputs, Observation, SkillBody
from aeros.spec.digests import code_digest, code_files
from aeros.spec.model import Ecm, Skill

SkillFunction = Callable[[Observation, Inputs], SkillBody]
Loader = Callable[[Ecm, Skill], SkillFunction]


class SkillRefusedError(Exception):
    """The skill's code is not what was certified, or is not a skill; the message says which."""


def load_skill(ecm: Ecm, skill: Skill) -> SkillFunction:
    """The generator function of `skill`, its module executed afresh, so no two runs share state.

    `sys.path` is left alone and the module's name is private, so nothing else can be loaded in its
    place, and it cannot import its neighbours by name.  Raises `SkillRefusedError`.
    """
    name = f"{skill.module_name.replace('.', '/')}.py"
    content = _certified_files(ecm).get(name)
    if content is None:
        raise SkillRefusedError(f"module `{ecm.id}` has no file `{name}`")
    module = _execute(ecm, skill.module_name, content, str(Path(ecm.folder) / name))
    function = module.__dict__.get(skill.function)
    if not inspect.isgeneratorfunction(function):
        raise SkillRefusedError(f"`{name}` of module `{ecm.id}` has no generator function `{skill.function}`")
    return function


def told(failure: BaseException) -> str:
    """An exception in words, even one that cannot tell itself."""
    try:
        message = str(failure)
    except Exception:
        message = "(it has no message)"
    return f"{type_name(failure)}: {message[:1000]}"


def _certified_files(ecm: Ecm) -> dict[str, bytes]:
    try:
        files = code_files(ecm.folder)
    except OSError as failure:
        raise SkillRefusedError(f"the code of module `{ecm.id}` cannot be read: {failure}") from failure
    found = code_digest(files)
    if found != ecm.code_digest:
        raise SkillRefusedError(
            f"the code of module `{ecm.id}` is not what was certified: "
            f"its digest is {found[:12]}…, certified is {ecm.code_digest[:12]}…"
        )
    return files


def _execute(ecm: Ecm, module_name: str, content: bytes, path: str) -> ModuleType:
    module = ModuleType(f"_aeros_ecm_{ecm.id}.{module_name}")
    module.__file__ = path
    # Standard library code (dataclasses, pickle) looks a class's module up here.
    sys.modules[module.__name__] = module
    try:
        exec(_compile(content, path), module.__dict__)  # noqa: S102 - what this file is for; digest checked
    except KeyboardInterrupt:
        raise
    except BaseException as failure:
        del sys.modules[module.__name__]
        raise SkillRefusedError(f"the code of module `{ecm.id}` fails to load: {told(failure)}") from failure
    return module


@lru_cache(maxsize=256)
def _compile(content: bytes, path: str) -> CodeType:
    return compile(content, path, "exec", dont_inherit=True)

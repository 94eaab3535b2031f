"""Skill code becomes a generator function, and what it raises becomes words.

Used where code runs: in a worker, and in the runtime's own process for modules the site trusts.  Imports
next to nothing, so that a worker has next to nothing in it.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from functools import lru_cache
from types import CodeType, ModuleType
from typing import Final

from aeros.descriptions import describe_exception, type_name
from aeros.skill import Action, Inputs, Observation, SkillBody

MAX_PARAMETERS: Final = 64
"""Parameters of one action at most; no kind has nearly as many, and every one is recorded."""

SkillFunction = Callable[[Observation, Inputs], SkillBody]


class SkillRefusedError(Exception):
    """The skill's code is not what was certified, or is not a skill; the message says which."""


class NoActionError(Exception):
    """What the skill yielded is no action, or what it returned no outputs; the message says what it is."""


def execute_skill(module: str, name: str, content: bytes, path: str, function: str) -> SkillFunction:
    """The generator function `function` of the file `name` of `module`, executed afresh.

    `sys.path` is left alone and the module's name is private, so nothing else can be loaded in its
    place, and it cannot import its neighbours by name.  Raises `SkillRefusedError`.
    """
    executed = _execute(module, name, content, path)
    found = executed.__dict__.get(function)
    if not inspect.isgeneratorfunction(found):
        raise SkillRefusedError(f"`{name}` of module `{module}` has no generator function `{function}`")
    return found


def copy_action(yielded: object) -> Action:
    """The action as it is now: later changes to its parameters change nothing that was decided.

    Raises `NoActionError`.
    """
    if type(yielded) is not Action:
        raise NoActionError(f"the skill yielded a `{type_name(yielded)}`, not an action")
    if type(yielded.parameters) is not dict or len(yielded.parameters) > MAX_PARAMETERS:
        raise NoActionError(f"the skill yielded parameters that are no dict of at most {MAX_PARAMETERS}")
    try:
        # Lists too are copied, to tuples; what is nested deeper no action kind has, so the gate denies it.
        parameters = {
            name: tuple(value) if type(value) is list else value
            for name, value in dict(yielded.parameters).items()
        }
    except Exception as failure:
        raise NoActionError(
            f"the skill yielded parameters that are no mapping: {describe_exception(failure)}"
        ) from failure
    if type(yielded.kind) is not str or not all(type(name) is str for name in parameters):
        raise NoActionError("the skill yielded a kind or a parameter name that is no text")
    return Action(yielded.kind, parameters)


def check_outputs(value: object) -> dict[str, object] | None:
    """What a skill returned at its end: its outputs as they are now, or None.  Raises `NoActionError`."""
    if value is None:
        return None
    if type(value) is not dict or len(value) > MAX_PARAMETERS:
        raise NoActionError(
            f"the skill returned a `{type_name(value)}`, not a dict of at most {MAX_PARAMETERS} outputs"
        )
    outputs = {name: tuple(part) if type(part) is list else part for name, part in value.items()}
    if not all(type(name) is str for name in outputs):
        raise NoActionError("the skill returned an output whose name is no text")
    return outputs


def _execute(module: str, name: str, content: bytes, path: str) -> ModuleType:
    dotted = name.removesuffix(".py").replace("/", ".")
    executed = ModuleType(f"_aeros_ecm_{module}.{dotted}")
    executed.__file__ = path
    # Standard library code (dataclasses, pickle) looks a class's module up here.
    sys.modules[executed.__name__] = executed
    try:
        exec(_compile(content, path), executed.__dict__)  # noqa: S102 - what this file is for; digest checked
    except KeyboardInterrupt:
        raise
    except BaseException as failure:
        del sys.modules[executed.__name__]
        raise SkillRefusedError(
            f"the code of module `{module}` fails to load: {describe_exception(failure)}"
        ) from failure
    return executed


@lru_cache(maxsize=256)
def _compile(content: bytes, path: str) -> CodeType:
    return compile(content, path, "exec", dont_inherit=True)

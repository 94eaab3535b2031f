"""From a step of a plan to the request for the runtime: an active skill and all its inputs.

A step names its module and skill, so there is nothing to choose yet; memory is asked only so that
the skill's record stands beside the decision to run it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from aeros.agent.graph import input_problems
from aeros.agent.memory import Memory
from aeros.agent.values import exact
from aeros.runtime.ports import Runtime, StepRequest
from aeros.spec.expr.semantics import Environment
from aeros.spec.model import Skill


class UndispatchableError(Exception):
    """There is no active skill for the step, or its inputs do not fit; the message says which."""


@dataclass(frozen=True, slots=True)
class Dispatch:
    """A request that may be submitted.

    inputs: the same inputs by `inputs.NAME`, exact, for the skill's precondition.
    record: successes and failures of the skill in memory.
    """

    request: StepRequest
    skill: Skill
    inputs: Environment
    record: tuple[int, int]


class Dispatcher:
    """Makes requests for skills that are active now, and not only when the plan was made."""

    def __init__(self, runtime: Runtime, memory: Memory) -> None:
        self._runtime = runtime
        self._memory = memory

    def dispatch(self, module: str, skill: str, inputs: Mapping[str, Any]) -> Dispatch:
        """The request for `module.skill` with defaults filled in; raises `UndispatchableError`."""
        active = self._runtime.active_modules().get(module)
        if active is None:
            raise UndispatchableError(f"the module `{module}` is not active")
        found = active.skills.get(skill)
        if found is None:
            raise UndispatchableError(f"`{module}` has no skill `{skill}`")
        problems = input_problems(found, inputs)
        if problems:
            raise UndispatchableError(f"`{module}.{skill}`: {'; '.join(problems)}")
        filled = {name: inputs.get(name, declared.default) for name, declared in found.inputs.items()}
        environment = {
            declared.name: exact(declared, filled[name]) for name, declared in found.inputs.items()
        }
        record = self._memory.record_of(f"{module}.{skill}")
        return Dispatch(StepRequest(module, skill, filled), found, environment, record)

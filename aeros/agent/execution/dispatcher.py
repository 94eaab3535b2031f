"""Make a request for the runtime from a step of a plan: an active skill and all its inputs.

If the step names a capability, one of its providers is chosen by Thompson sampling: among the providers whose
preconditions are measured as true, the one with the highest chance of success drawn from its posterior in
this context. So providers that worked better are chosen more often and little-known ones are still tried. The
proof of the planning rules covers every provider, so any choice is covered by it. The draw is a function of
the seed and of the memory's content: the same memory gives the same choice. A provider that the gate has
denied for good in this run is chosen only if there is no other.

The choice is only a request: the gate decides its actions like any others and does not read memory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from random import Random
from typing import Any

from aeros.agent.execution.supervisor import start_obstacle
from aeros.agent.memory.context import evidence_context
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.store import DurationStats, Memory
from aeros.agent.planning.task_graph import input_problems
from aeros.agent.world.values import to_exact
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import Runtime, StepRequest
from aeros.spec.expr.semantics import Environment
from aeros.spec.model.cause import Cause
from aeros.spec.model.ecm import Ecm, Skill


class DispatchError(Exception):
    """A step for which nothing can be started; the message says why, `causes` says the same as data."""

    def __init__(self, reason: str, *causes: Cause) -> None:
        super().__init__(reason)
        self.causes = causes


@dataclass(frozen=True, slots=True)
class ProviderOption:
    """A provider as the choice saw it.

    Attributes:
        skill: id of the skill.
        record: successes and failures in the context of the choice.
        sampled_success: chance of success drawn for it, in [0, 1]; None if it was not available.
        unavailable_reason: why it was not available; empty if it was.
    """

    skill: str
    record: SuccessRecord
    sampled_success: float | None
    unavailable_reason: str = ""

    def __str__(self) -> str:
        text = f"`{self.skill}` {self.record} succeeded"
        return (
            f"{text}, not now: {self.unavailable_reason}"
            if self.sampled_success is None
            else f"{text}, drew {self.sampled_success:.3f}"
        )


@dataclass(frozen=True, slots=True)
class Dispatch:
    """A request that may be submitted.

    Attributes:
        request: request for the runtime.
        skill: skill that it names.
        context: context in which its ending is evidence; see `memory/context.py`.
        record: successes and failures of the skill in all contexts.
        typical_duration: duration of its latest successes (s); None if there are none.
        options: providers that were considered, the chosen one included; empty if the step names a skill.
    """

    request: StepRequest
    skill: Skill
    context: str
    record: SuccessRecord
    typical_duration: DurationStats | None
    options: tuple[ProviderOption, ...] = ()


class Dispatcher:
    """Maker of requests for skills that are active and may start now, not only at planning time."""

    def __init__(self, runtime: Runtime, memory: Memory, task: str, seed: int = 0) -> None:
        self._runtime = runtime
        self._memory = memory
        self._task = task
        self._seed = seed
        self.denied: set[tuple[str, str]] = set()

    def avoid(self, module: str, skill: str) -> None:
        """Prefer other providers from now on, because the gate has denied this skill for good.

        Args:
            module: id of the module.
            skill: id of the skill.
        """
        self.denied.add((module, skill))

    def dispatch(self, module: str, name: str, inputs: Mapping[str, Any], world: WorldModel) -> Dispatch:
        """Make the request for a skill, or for the best provider of a capability.

        Args:
            module: id of the module.
            name: skill or capability of the module.
            inputs: inputs of the step by name (SI); defaults are filled in.
            world: current state, which the conditions are checked against.

        Returns:
            The request, with the records that explain the choice.

        Raises:
            DispatchError: the module is not active, has no such skill, or no provider can start now.
        """
        active = self._runtime.active_modules().get(module)
        if active is None:
            raise DispatchError(f"the module `{module}` is not active")
        providers = [active.skills[one] for one in active.providers(name)]
        if not providers:
            raise DispatchError(f"`{module}` has no skill `{name}`")
        problems = {one.id: _problem(active, one, inputs, world) for one in providers}
        context = evidence_context(self._task, active, providers, world)
        records = {one.id: self._memory.success_record(module, one.id, context) for one in providers}
        options = self._options(module, problems, records)
        chosen = max(options, key=lambda one: -1.0 if one.sampled_success is None else one.sampled_success)
        if chosen.sampled_success is None:
            unable = [problem for problem in problems.values() if problem is not None]
            raise DispatchError("; ".join(map(_problem_text, unable)), *unable)
        skill = active.skills[chosen.skill]
        return Dispatch(
            StepRequest(module, skill.id, _with_defaults(skill, inputs)),
            skill,
            context,
            self._memory.success_record(module, skill.id),
            self._memory.typical_duration(module, skill.id),
            options if name not in active.skills else (),
        )

    def _options(
        self, module: str, problems: Mapping[str, Cause | None], records: Mapping[str, SuccessRecord]
    ) -> tuple[ProviderOption, ...]:
        can = {name for name, problem in problems.items() if problem is None}
        preferred = {name for name in can if (module, name) not in self.denied} or can
        random = Random(f"{self._seed} {self._memory.latest_episode()}")  # noqa: S311  exploration, no secret
        # Drawn for each, so that a draw does not depend on which of the others may start.
        drawn = {name: record.sample(random) for name, record in records.items()}
        return tuple(
            ProviderOption(name, record, drawn[name])
            if name in preferred
            else ProviderOption(name, record, None, _unavailable_reason(problems[name]))
            for name, record in records.items()
        )


def _problem(module: Ecm, skill: Skill, inputs: Mapping[str, Any], world: WorldModel) -> Cause | None:
    """Return the reason that `skill` cannot start now, or None."""
    unfit = input_problems(skill, inputs)
    if unfit:
        return Cause("input", f"{module.id}.{skill.id}", "; ".join(unfit))
    return start_obstacle(module.id, skill, world, _environment(skill, inputs))


def _problem_text(problem: Cause) -> str:
    if problem.kind == "input":
        return f"`{problem.rule}`: {problem.text}"
    what = "its hold-condition" if problem.kind == "hold" else "its precondition"
    return f"{what} `{problem.text}` is not met: {', '.join(map(str, problem.shortfalls))}"


def _unavailable_reason(problem: Cause | None) -> str:
    return "it was denied" if problem is None else _problem_text(problem)


def _with_defaults(skill: Skill, inputs: Mapping[str, Any]) -> dict[str, Any]:
    return {name: inputs.get(name, declared.default_value) for name, declared in skill.inputs.items()}


def _environment(skill: Skill, inputs: Mapping[str, Any]) -> Environment:
    filled = _with_defaults(skill, inputs)
    return {declared.name: to_exact(declared, filled[name]) for name, declared in skill.inputs.items()}

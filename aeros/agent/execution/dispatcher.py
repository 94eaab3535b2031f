"""Make a request for the runtime from a step of a plan: an active skill and all its inputs.

If the step names a capability, one of its alternatives is chosen (`provider_choice.py`) among those whose
preconditions are measured as true, by their results in this context and by their usual durations. They may be
of several modules: of the step's own, or of those that it requires. One may be a composition: then its record
is that of the skill of it that succeeded least, and its duration the sum of those of its skills.

The proof of the planning rules covers every provider, so any choice is covered by it. The draw is a function
of the seed and of the memory's content: the same memory gives the same choice. A provider that the gate has
denied for good in this run is chosen only if there is no other.

The choice is only a request: the gate decides its actions like any others and does not read memory.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any, Final

from aeros.agent.execution.provider_choice import ProviderChoice, ProviderOption, choose_provider
from aeros.agent.execution.supervisor import composition_obstacle, start_obstacle
from aeros.agent.memory.context import context_in_any_state, evidence_context
from aeros.agent.memory.evidence import DurationStats, SkillId
from aeros.agent.memory.posterior import NO_RESULTS, RecentRecord, SuccessRecord
from aeros.agent.memory.store import Memory
from aeros.agent.planning.task_graph import input_problems
from aeros.agent.world.values import to_exact
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import Runtime, StepRequest
from aeros.spec.expr.semantics import Environment
from aeros.spec.model.cause import Cause
from aeros.spec.model.composition import Composition
from aeros.spec.model.ecm import Alternative, Ecm, Skill, owner_of

_NO_CHOICE: Final = ProviderChoice((), None, "")


class DispatchError(Exception):
    """A step for which nothing can be started; the message says why, `causes` says the same as data."""

    def __init__(self, reason: str, *causes: Cause) -> None:
        super().__init__(reason)
        self.causes = causes


@dataclass(frozen=True, slots=True)
class Dispatch:
    """A request that may be submitted.

    Attributes:
        request: request for the runtime.
        skill: skill that it names.
        context: context in which its ending is evidence; see `memory/context.py`.
        record: successes and failures of the skill in all contexts.
        typical_duration: duration of its latest successes (s); None if there are none.
        choice: providers that were considered, and why it was chosen; without options if the step names a
            skill.
        caller: id of the module whose step asked for it.
        code: digest of the code of the skill's module.
    """

    request: StepRequest
    skill: Skill
    context: str
    record: SuccessRecord
    typical_duration: DurationStats | None
    choice: ProviderChoice = _NO_CHOICE
    caller: str = ""
    code: str = ""


@dataclass(frozen=True, slots=True)
class ChosenComposition:
    """A composition that provides a capability and was chosen.

    Attributes:
        name: name of the alternative.
        module: id of the module that asks for it.
        composition: the composition, with its skills named as that module names them.
        context: context of the choice.
        choice: alternatives that were considered, and why it was chosen.
    """

    name: str
    module: str
    composition: Composition
    context: str
    choice: ProviderChoice = _NO_CHOICE


class Dispatcher:
    """Maker of requests for skills that are active and may start now, not only at planning time."""

    def __init__(self, runtime: Runtime, memory: Memory, task: str, seed: int = 0) -> None:
        self._runtime = runtime
        self._memory = memory
        self._task = task
        self._seed = seed
        self._explorations: Counter[str] = Counter()
        self.denied: set[SkillId] = set()

    def avoid(self, module: str, skill: str) -> None:
        """Prefer other providers from now on, because this skill was denied for good or its code raised.

        Args:
            module: id of the module.
            skill: id of the skill.
        """
        self.denied.add((module, skill))

    def has_another(self, dispatch: Dispatch) -> bool:
        """Say if another provider than those to avoid could have started instead.

        Args:
            dispatch: a request that was made.

        Returns:
            True if the next choice in the same state is another.
        """
        return any(
            one.sampled_success is not None and owner_of(one.skill, dispatch.caller) not in self.denied
            for one in dispatch.choice.options
        )

    def dispatch(
        self, module: str, name: str, inputs: Mapping[str, Any], world: WorldModel
    ) -> Dispatch | ChosenComposition:
        """Make the request for a skill, or for the best alternative of a capability.

        A skill of another module is requested from that module, so that its own permissions apply.

        Args:
            module: id of the module.
            name: skill or capability of the module, or one that it may call of others.
            inputs: inputs of the step by name (SI); defaults are filled in.
            world: current state, which the conditions are checked against.

        Returns:
            The request, with the records that explain the choice; or the composition to be run.

        Raises:
            DispatchError: a module is not active, has no such skill, or no alternative can start now.
        """
        active = self._runtime.active_modules().get(module)
        if active is None:
            raise DispatchError(f"the module `{module}` is not active")
        candidates = [self._candidate(active, one, inputs, world) for one in active.alternatives(name)]
        if not candidates:
            raise DispatchError(f"`{module}` has no skill `{name}`")
        runs = [run for one in candidates for run in one.runs]
        others = [ecm for ecm, _ in runs if ecm.id != module]
        context = evidence_context(self._task, active, [skill for _, skill in runs], world, others)
        choice = self._choose(f"{module}.{name}", candidates, context)
        if choice.chosen is None:
            unable = [one.problem for one in candidates if one.problem is not None]
            raise DispatchError("; ".join(map(_problem_text, unable)), *unable)
        chosen = candidates[choice.chosen]
        if name in active.callable_skills:
            choice = _NO_CHOICE
        if chosen.composition is not None:
            return ChosenComposition(chosen.name, module, chosen.composition, context, choice)
        ((owner, skill),) = chosen.runs
        return Dispatch(
            StepRequest(owner.id, skill.id, _with_defaults(skill, inputs)),
            skill,
            context,
            self._memory.success_record(owner.id, skill.id),
            self._memory.typical_duration(owner.id, skill.id, owner.behaviour_digest),
            choice,
            module,
            owner.behaviour_digest,
        )

    def _candidate(
        self, module: Ecm, one: Alternative, inputs: Mapping[str, Any], world: WorldModel
    ) -> _Candidate:
        active = self._runtime.active_modules()
        runs, missing = [], ""
        for name in one.skills:
            owner, own_name = owner_of(name, module.id)
            skill = active[owner].skills.get(own_name) if owner in active else None
            if skill is None:
                missing = missing or name
            else:
                runs.append((active[owner], skill))
        problem: Cause | None
        if missing:
            problem = Cause("inactive", missing, "its module is not active")
        elif one.composition is None:
            ((owner_module, skill),) = runs
            problem = _problem(owner_module, skill, inputs, world)
        else:
            problem = composition_obstacle(f"{module.id}.{one.name}", one.composition, world)
        return _Candidate(one.name, tuple(runs), one.composition, problem)

    def _choose(self, capability: str, candidates: Sequence[_Candidate], context: str) -> ProviderChoice:
        can = [one for one in candidates if one.problem is None]
        preferred = [one for one in can if not self.denied & one.names] or can
        random = Random(f"{self._seed} {self._memory.latest_episode()}")  # noqa: S311  exploration, no secret
        alone = {run: context for one in candidates if one.composition is None for run in one.run_ids}
        composed = {
            (ecm.id, skill.id): context_in_any_state(self._task, ecm)
            for one in candidates
            if one.composition is not None
            for ecm, skill in one.runs
        }
        contexts = {**composed, **alone}
        recent = self._memory.recent_records(contexts)
        options = [
            self._option(one, contexts, recent, "" if one in preferred else _unavailable_reason(one.problem))
            for one in candidates
        ]
        choice = choose_provider(options, random, self._explorations[capability])
        self._explorations[capability] += choice.is_exploration
        return choice

    def _option(
        self,
        one: _Candidate,
        contexts: Mapping[SkillId, str],
        recent: Mapping[SkillId, RecentRecord],
        unavailable: str,
    ) -> ProviderOption:
        # A composition is as good as the skill of it that succeeded least. Without any records, each
        # alternative is as likely as another.
        # A skill that never ran, as a handler, says nothing beside others that did.
        tried = [run for run in one.run_ids if recent[run].successes + recent[run].failures > 0]
        weakest = min(tried or one.run_ids, key=lambda run: recent[run].mean, default=None)
        record = SuccessRecord(0, 0)
        if weakest is not None:
            record = self._memory.success_record(*weakest, contexts[weakest])
        took = [
            self._memory.recent_duration(ecm.id, skill.id, ecm.behaviour_digest, contexts[ecm.id, skill.id])
            for ecm, skill in one.runs
        ]
        seconds = [one for one in took if one is not None]
        return ProviderOption(
            one.name,
            record,
            NO_RESULTS if weakest is None else recent[weakest],
            sum(seconds) if seconds and len(seconds) == len(took) else None,
            unavailable,
            wear_s=float(sum(skill.wear for _, skill in one.runs)),
        )


@dataclass(frozen=True, slots=True)
class _Candidate:
    """An alternative with the active skills that it may run, and the reason that it cannot start now."""

    name: str
    runs: tuple[tuple[Ecm, Skill], ...]
    composition: Composition | None
    problem: Cause | None

    @property
    def run_ids(self) -> tuple[SkillId, ...]:
        return tuple((ecm.id, skill.id) for ecm, skill in self.runs)

    @property
    def names(self) -> set[SkillId]:
        return set(self.run_ids)


def _problem(module: Ecm, skill: Skill, inputs: Mapping[str, Any], world: WorldModel) -> Cause | None:
    """Return the reason that `skill` cannot start now, or None."""
    unfit = input_problems(skill, inputs)
    if unfit:
        return Cause("input", f"{module.id}.{skill.id}", "; ".join(unfit))
    return start_obstacle(module.id, skill, world, _environment(skill, inputs))


def _problem_text(problem: Cause) -> str:
    if problem.kind in ("input", "inactive"):
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

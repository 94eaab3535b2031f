"""The symbolic plant: declared outcomes with declared probabilities, in microseconds.

It is the simulator of lowest fidelity. Motions take effect at once and cost time on the plant's clock;
predicates change only when a skill ends, by one of the outcomes that its manifest declares, or as the
base leaves where its definition holds. So it runs the model of the world that the
closed-loop analysis assumes.
Not modelled: anything that a manifest does not declare; where an interrupted motion stops; events while a
skill takes the rest of its declared duration after its last action.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

from aeros.runtime.ports import (
    ColumnNames,
    Monitor,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    PlannedMotion,
    Readings,
    Snapshot,
)
from aeros.sim.robot.errors import ActionRejectedError
from aeros.sim.symbolic.definitions import PlaceDefinitions
from aeros.sim.symbolic.motions import SymbolicMotion, check_parameters, plan_motion
from aeros.sim.symbolic.outcomes import (
    BurstOutcomes,
    DrawnOutcome,
    OutcomeSampler,
    outcome_probabilities_by_skill,
    quantities_after,
)
from aeros.sim.symbolic.parameter_facts import ParameterFacts
from aeros.sim.symbolic.state import answers_of_tools, as_reading, initial_values, unknown_positions
from aeros.skill import Action
from aeros.spec.consequences.consequences import modules_with_consequences
from aeros.spec.consequences.start_values import with_defined_predicates
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr.effects import Increment
from aeros.spec.model.ecm import Ecm, Outcome
from aeros.spec.model.site import Site

_COMPLETED: Final = MotionCompletion(True)

_NO_BODY: Final = NoMotion("this plant has no body")


class _PlannedAction(NamedTuple):
    """An action, its plan and effects, and the values that these were computed from."""

    action: Action
    plan: PlannedMotion
    motion: SymbolicMotion
    measured: Mapping[str, Any]


@dataclass(slots=True)
class _RunningAction:
    """An action under way, its effects with the values that they were computed from, and its end, s."""

    action: Action
    motion: SymbolicMotion
    measured: Mapping[str, Any]
    end_time: float
    is_halted: bool = False


def _end_time(under_way: tuple[MotionHandle, _RunningAction]) -> float:
    return under_way[1].end_time


class SymbolicPlant:
    """Implementation of `aeros.runtime.ports.Plant` from declarations alone; readings are always fresh.

    Args:
        site: whose vocabulary is measured.
        modules: modules whose skills may run, by name.
        seed: the same seed and the same steps give the same run.
        initial: initial values that differ from the harmless default, by vocabulary name, SI. A position of a
            module that neither they nor an outcome give is not measured: a robot that drove to a made-up
            place would show something that is not so.
        bursts: distributions of the skills whose outcomes come in bursts, by `module.skill`.

    Raises:
        MisuseError: `initial` or an effect names an unknown state variable, or outcomes are not a
            distribution.
    """

    def __init__(
        self,
        site: Site,
        modules: Mapping[str, Ecm],
        seed: int,
        initial: Mapping[str, Any] | None = None,
        bursts: Mapping[str, BurstOutcomes] | None = None,
    ) -> None:
        own = {name: one for ecm in modules.values() for name, one in ecm.state.items()}
        self._site = site = replace(site, state={**own, **site.state})
        self._facts = ParameterFacts(modules)
        definitions = {name: one for ecm in modules.values() for name, one in ecm.definitions.items()}
        given = with_defined_predicates({**self._facts.defaults, **(initial or {})}, definitions)
        start = initial_values(site, given)
        # What a site shares of a module that is not there, nobody measures.
        unknown = unknown_positions(modules.values(), given) | answers_of_tools(site, given)
        self._names = ColumnNames(
            [
                name
                for name in site.state
                if name not in unknown and ("." not in name or name.partition(".")[0] in modules)
            ]
        )
        self._initial = {name: start[name] for name in self._names.names}
        # As on any plant: no rule reads the other variables of modules, and their values stop nothing.
        self._monitored = [name for name in self._names.names if name in site.rule_variables]
        self._definitions = PlaceDefinitions(site, modules.values())
        self._definitions.update(self._initial)
        self._shares = outcome_probabilities_by_skill(modules_with_consequences(modules, site).values())
        self._effects = {
            (name, outcome.id): _readings_after(self._site, name, outcome, self._initial)
            for name, shares in self._shares.items()
            for outcome, _ in shares
        }
        self._bursts = bursts or {}
        self._begin(seed)

    def reset(self, seed: int) -> SymbolicPlant:
        """Make a plant in the initial state of this one, with another seed; cheap, for many trials.

        Args:
            seed: of the new plant.

        Returns:
            The new plant; this one is unchanged.
        """
        plant = copy(self)
        plant._begin(seed)
        return plant

    def _begin(self, seed: int) -> None:
        self._draws = OutcomeSampler(self._shares, self._bursts, seed)
        self._drawn: list[DrawnOutcome] = []
        self._runs: dict[str, int] = dict.fromkeys(self._shares, 0)
        self._time = 0.0
        self._facts = copy(self._facts)
        self._facts.restart()
        # Cached readings of now, until time passes or a value changes.
        self._observed: Readings | None = None
        # Replaced, never mutated: results computed from it can check by identity that they still hold.
        self._values: Mapping[str, Any] = self._initial
        self._planned: _PlannedAction | None = None
        self._start_times: dict[str, float] = {}
        self._under_way: dict[MotionHandle, _RunningAction] = {}
        self._motion_count = 0

    def now(self) -> float:
        """Implement `Plant.now`: seconds that motions, waits and declared durations have cost so far."""
        return self._time

    def observe(self) -> Readings:
        """Implement `Plant.observe`: every state variable of the vocabulary, measured now."""
        if self._observed is None:
            self._observed = Snapshot(self._names, tuple(self._values.values()), self._time)
        return self._observed

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan`: there is no body, so no plan moves anything."""
        try:
            motion = self._motion_of(action)
        except ActionRejectedError as reason:
            return MotionCompletion(False, str(reason))
        self._planned = _PlannedAction(action, _NO_BODY, motion, self._values)
        return self._planned.plan

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`."""
        planned, self._planned = self._planned, None
        if (
            planned is not None
            and planned.action is action
            and planned.plan is decided
            and planned.measured is self._values
        ):
            motion = planned.motion
        else:
            try:
                motion = self._motion_of(action)
            except ActionRejectedError as reason:
                return MotionCompletion(False, str(reason))
        self._motion_count += 1
        ends = self._time + motion.duration
        if self._site.kinds[action.kind].plant_word == "move_tool":
            # The base may carry the tool to its target: the tool arrives no earlier than the base.
            for running in self._under_way.values():
                if self._site.kinds[running.action.kind].plant_word == "move_base":
                    ends = max(ends, running.end_time)
        self._under_way[MotionHandle(self._motion_count)] = _RunningAction(action, motion, self._values, ends)
        return MotionHandle(self._motion_count)

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`: let the next motion end.

        The monitor sees the values that rules may read: during that motion, and at its end.
        """
        if not self._under_way:
            self._time = max(self._time, until)
            self._observed = None
            return {}
        first, running = min(self._under_way.items(), key=_end_time)
        # Its end may depend on changes that another motion has made since it began.
        changed = (
            running.motion if running.measured is self._values else self._motion_of(running.action)
        ).values_after
        others = [other.motion.values_during for motion, other in self._under_way.items() if motion != first]
        for last in (running.motion.values_during, changed):
            values = self._set_values([*others, last])
            rule = monitor(self._time, {name: values[name] for name in self._monitored})
            if rule is not None:
                return self._end_motions(list(self._under_way), f"monitor:{rule}")
        halted = [motion for motion, other in self._under_way.items() if other.is_halted]
        if halted:
            return self._end_motions(halted, "halted")
        if running.end_time > until:
            self._time = max(self._time, until)
            self._observed = None
            return {}
        del self._under_way[first]
        self._time = max(self._time, running.end_time)
        self._values = self._set_values([changed]) if others else values
        self._observed = None
        return {first: _COMPLETED}

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`: coming to rest takes no time."""
        self._under_way[motion].is_halted = True

    def stop(self) -> None:
        """Implement `Plant.stop`: drop every motion."""
        self._under_way.clear()

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`: note the time.

        Raises:
            MisuseError: no module has the skill.
        """
        if skill not in self._shares:
            raise MisuseError(f"no module has the skill `{skill}`")
        self._start_times[skill] = self._time

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`: if the skill finished, draw an outcome and apply its effects.

        A skill that was halted has none of its declared outcomes: nothing changes.
        """
        if not finished:
            return
        run = self._runs[skill]
        self._runs[skill] += 1
        outcome = self._draws.outcome(skill, run)
        self._drawn.append(DrawnOutcome(skill, run, outcome.id))
        if outcome.duration is not None:
            self._time = max(self._time, self._start_times[skill] + float(outcome.duration))
        self._values = self._set_values(
            [self._effects[skill, outcome.id], quantities_after(outcome, self._values)]
        )
        self._observed = None

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set the parameters of the task; see `announce_parameters`.

        Args:
            values: values (SI) of parameters of tasks, by full name; the others have their defaults.
        """
        changes = self._facts.change(values, self._values, self._initial)
        if changes:
            self._values = self._set_values([changes])
            self._observed = self._planned = None

    def drawn_outcomes(self) -> tuple[DrawnOutcome, ...]:
        """Return all outcomes drawn so far; they are the only random events of the run.

        Returns:
            The outcomes, in order.
        """
        return tuple(self._drawn)

    def close(self) -> None:
        """Implement `Plant.close`: nothing to release."""

    def _motion_of(self, action: Action) -> SymbolicMotion:
        """Compute the effects of `action`.

        Raises:
            ActionRejectedError: there is no such action kind.
        """
        kind = self._site.kinds.get(action.kind)
        if kind is None:
            raise ActionRejectedError(f"unknown kind: `{action.kind}`")
        check_parameters(kind, action.parameters)
        asked = Action(kind.plant_word, action.parameters)
        duration, under_way, after = plan_motion(asked, self._values, self._site)
        return SymbolicMotion(duration, self._vocabulary_values(under_way), self._vocabulary_values(after))

    def _set_values(self, changes: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
        values = dict(self._values)
        for change in changes:
            values.update(change)
            self._definitions.update(values, change)
        return values

    def _end_motions(self, motions: Sequence[MotionHandle], why: str) -> dict[MotionHandle, MotionCompletion]:
        for motion in motions:
            del self._under_way[motion]
        return dict.fromkeys(motions, MotionCompletion(False, why))

    def _vocabulary_values(self, values: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return those values whose names are in the site's vocabulary."""
        if values.keys() <= self._values.keys():
            return values
        return {name: value for name, value in values.items() if name in self._values}


def _readings_after(site: Site, skill: str, outcome: Outcome, measured: Collection[str]) -> dict[str, Any]:
    """Return the values that an outcome states, but for counts.

    Raises:
        MisuseError: it states one that is not measured.
    """
    changed = {*outcome.effects, *(one.variable for one in outcome.ranges)}
    unknown = changed - set(measured)
    if unknown:
        raise MisuseError(f"an effect of `{skill}` is on `{min(unknown)}`, which is not a state variable")
    return {
        name: as_reading(effect, site.state[name])
        for name, effect in outcome.known_effects.items()
        if not isinstance(effect, Increment)
    }

"""Symbolic exploration of every path of outcomes through a composition, from all states at once.

A situation is what is known at one point of a path.  Effects are constants and increments, so the state at
that point is the state at the start with some variables replaced, each by a value, or by its value at the
start and an amount.  The decisions on the way are a set of conditions on the state at the start.  Equal
situations are merged, so paths that meet are explored once.

Predicates (truth values and enum members) and whole numbers that outcomes set change by declared effects
alone, as in the closed loop.  A predicate with a definition that an outcome leaves at either value
(`aeros.spec.consequences`) is forgotten then, like a measurement.
Every other state variable may change whenever a skill runs, so nothing known about it outlives a skill: a
guard such as `human_distance > 1 m`, or a range that an outcome states, holds for the very next step alone.
The value that it had when it was decided on is kept as `human_distance@1`, so that a path that was never
possible does not become possible.

Each branch of a `par` is explored by itself.  Where no branch writes what another reads or writes, which is a
claim of its own, the interleaving changes nothing for a branch.  The part after the `par` is reached when all
branches have succeeded.  While another branch may run a skill, only predicates are known.  Where a branch
fails, the others are stopped anywhere: all that their steps may set is forgotten.

A part under `hold` or within `timeout` may be stopped before each of its steps and after each, done or not,
and fails then.  What the condition reads is forgotten; between its steps, the condition is known to hold.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from aeros.spec.consequences.disturbance import Definitions, disturbed_by_changes
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment
from aeros.spec.expr.lower import lower
from aeros.spec.expr.types import BoolType, EnumType, IntegerType
from aeros.spec.flow.arguments import effect_term
from aeros.spec.model.composition import Composition, Part, Step, handlers_of
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.hold_conditions import HOLD_LOST, hold_loss_outcomes, numbers_read, stop_outcomes
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
    steps_of,
)
from aeros.spec.model.task_parameters import is_parameter
from aeros.spec.model.variables import Declared

MAX_SYMBOLIC_STATES = 20_000

OutcomeTrace = tuple[str, ...]


class TooManyPathsError(Exception):
    """A composition has more than `MAX_SYMBOLIC_STATES` situations."""


@dataclass(frozen=True)
class SymbolicState:
    """Knowledge at one point of a path.

    Attributes:
        assignment: state variables that were set on the path, with their values; an increment counts from the
            value at the start.
        path_condition: conditions on the state at the start.
        ranges: conditions on quantities, as the outcome of the skill that ran last states them.
    """

    assignment: frozenset[tuple[str, Any]] = frozenset()
    path_condition: frozenset[t.Term] = frozenset()
    ranges: frozenset[t.Term] = frozenset()

    @property
    def known(self) -> frozenset[t.Term]:
        """All conditions that hold at this point."""
        return self.path_condition | self.ranges

    def condition(self, term: t.Term, state: Mapping[str, Declared]) -> t.Term:
        """Express a condition at this point as a condition on the state at the start.

        Args:
            term: condition on the state at this point.
            state: state variables of the site by name.

        Returns:
            The condition; a literal where the assigned values decide it.
        """
        values = {name: effect_term(value, state[name].variable) for name, value in self.assignment}
        return fold_constants(t.substitute(term, values))


SymbolicStates = dict[SymbolicState, OutcomeTrace]
"""The situations at a point, each with the outcomes on one of the paths there."""


@dataclass
class _RunExploration:
    """Exploration of single runs of skills, of which `PathExploration` makes paths, with their attributes."""

    skills: Mapping[str, Skill]
    state: Mapping[str, Declared]
    handlers: Mapping[str, Step]
    states_at_steps: dict[str, SymbolicStates] = field(default_factory=dict)
    states_at_ifs: dict[int, SymbolicStates] = field(default_factory=dict)
    states_after_parts: dict[int, SymbolicStates] = field(default_factory=dict)
    final_states: SymbolicStates = field(default_factory=dict)
    definitions: Definitions = field(default_factory=dict)
    _stops: list[SymbolicStates] = field(default_factory=list)
    _held: list[t.Term] = field(default_factory=list)
    _count: int = 0
    _depth: int = 0
    _is_recording: bool = True

    @cached_property
    def settable(self) -> frozenset[str]:
        """Names of the state variables that some skill can set."""
        skills = self.skills.values()
        return frozenset(name for one in skills for o in one.outcomes.values() for name in o.effects)

    def _decide(self, condition: t.Term, before: SymbolicStates) -> tuple[SymbolicStates, SymbolicStates]:
        """Split situations into those in which a condition holds, and those in which it does not."""
        then: SymbolicStates = {}
        otherwise: SymbolicStates = {}
        for situation, trace in before.items():
            holds = situation.condition(condition, self.state)
            for branch, term in ((then, holds), (otherwise, fold_constants(t.Not(holds)))):
                if term != t.FALSE:
                    known = replace(
                        situation, path_condition=situation.path_condition | split_conjunction(term)
                    )
                    branch.setdefault(self._forget_measurements(known) if self._depth else known, trace)
        return then, otherwise

    def _still_held(self, situations: SymbolicStates) -> SymbolicStates:
        """Keep the situations in which all conditions around hold, and note there that they do."""
        for term in self._held:
            situations, _ = self._decide(term, situations)
        return situations

    def _run(self, step: Step, before: SymbolicStates, done: SymbolicStates) -> SymbolicStates:
        """Return the situations after a failure; add those after a success to `done`."""
        failed: SymbolicStates = {}
        succeeded: SymbolicStates = {}
        for name in step.runs:
            skill = self.skills[name]
            shown = step.id if len(step.runs) == 1 else f"{step.id} by {name}"
            declared = [one for one in skill.outcomes.values() if one.probability != 0]
            hold = skill.hold_condition
            freed = frozenset() if hold is None else numbers_read(hold)
            for outcome in (*declared, *hold_loss_outcomes(skill, self.settable)):
                for situation, trace in before.items():
                    after = self._apply_outcome(situation, outcome)
                    if outcome.id == HOLD_LOST and freed:
                        after = self._forget_measurements(after, freed)
                    ended = (*trace, f"{shown} → {outcome.id}")
                    (failed if outcome.failure else succeeded).setdefault(after, ended)
                    for other in _measured_instead(skill, outcome):
                        if _may_hold(other, situation, after):
                            both = {**outcome.effects, **other.effects}
                            mistaken = self._apply_outcome(situation, _with_effects(outcome, both))
                            ended = (*trace, f"{shown} → {other.id}")
                            (failed if other.failure else succeeded).setdefault(mistaken, ended)
            self._note_stops(skill, before, shown)
        for stops in self._stops:
            _merge(stops, {**succeeded, **failed})
        _merge(done, self._still_held(succeeded))
        return self._still_held(failed)

    def _note_stops(self, skill: Skill, before: SymbolicStates, shown: str) -> None:
        """Note the situations in which a run of a skill may be stopped with a part around it."""
        for outcome in stop_outcomes(skill) if self._stops else ():
            for situation, trace in before.items():
                after = self._apply_outcome(situation, outcome)
                for stops in self._stops:
                    stops.setdefault(after, (*trace, f"{shown} → {outcome.id}"))

    def _apply_outcome(self, situation: SymbolicState, outcome: Outcome) -> SymbolicState:
        before = self._forget_measurements(situation, outcome.unsettled)
        assigned = frozenset(_assigned_after(dict(before.assignment), outcome.known_effects).items())
        ranges = frozenset(one.term(self.state[one.variable].variable) for one in outcome.ranges)
        after = SymbolicState(assigned, before.path_condition, ranges)
        return self._forget_measurements(after) if self._depth else after

    def _forget_measurements(
        self, situation: SymbolicState, unsettled: Collection[str] = ()
    ) -> SymbolicState:
        """Rename measurements that are out of date once a skill has run to `NAME@1` and so on.

        Of the ranges, only those of quantities that were decided on are kept.
        """
        decided = {name for term in situation.path_condition for name in t.variables_of(term)}
        conditions = situation.path_condition.union(
            term for term in situation.ranges if not decided.isdisjoint(t.variables_of(term))
        )
        known = {name: one for term in conditions for name, one in t.variables_of(term).items()}
        number = 1 + max((int(name.partition("@")[2]) for name in known if "@" in name), default=0)
        earlier: dict[str, t.Term] = {
            name: replace(one, name=f"{name}@{number}")
            for name, one in known.items()
            if one.role is t.VariableRole.STATE and (name in unsettled or not self._is_persistent(name))
        }
        return SymbolicState(
            frozenset(
                (name, value)
                for name, value in situation.assignment
                if name not in unsettled and self._is_persistent(name)
            ),
            frozenset(t.substitute(term, earlier) for term in conditions) if earlier else conditions,
        )

    def _is_persistent(self, name: str) -> bool:
        """Tell whether a variable keeps its value between skills.

        Predicates do, whole numbers that some outcome sets, and earlier measurements.
        """
        if "@" in name:
            return True
        type_ = self.state[name].variable.type
        return isinstance(type_, BoolType | EnumType) or (
            isinstance(type_, IntegerType) and (name in self.settable or is_parameter(self.state[name]))
        )

    def _record_visit(self, name: str, situations: SymbolicStates) -> None:
        self._count += len(situations)
        if self._count > MAX_SYMBOLIC_STATES:
            raise TooManyPathsError
        if self._is_recording:
            _merge(self.states_at_steps.setdefault(name, {}), situations)


@dataclass
class PathExploration(_RunExploration):
    """Exploration of a composition, and the situations met so far.

    Attributes:
        skills: skills of the module by name.
        state: state variables of the site by name.
        handlers: handlers of the composition by name.
        states_at_steps: by step or `handler/NAME`, the situations in which its skill is about to start.
        states_at_ifs: by `id` of an `if`, as the same may stand at two places, the situations in which it
            is decided.
        states_after_parts: by `id` of a part under `hold` or within `timeout`, those in which it has
            succeeded.
        final_states: the situations in which the whole composition has succeeded.
        definitions: definitions of predicates by full name.
    """

    def execute(self, part: Part, before: SymbolicStates, failed: SymbolicStates) -> SymbolicStates:
        """Explore a part of the composition and record the situations met in it.

        Args:
            part: part of the composition.
            before: situations before the part.
            failed: receives the situations in which a step of it has failed for good.

        Returns:
            The situations in which the part has succeeded.

        Raises:
            TooManyPathsError: more than `MAX_SYMBOLIC_STATES` situations were met.
        """
        match part:
            case Step():
                return self._step(part, before, part.id, failed)
            case Seq(parts=inner):
                for one in inner:
                    before = self.execute(one, before, failed)
                return before
            case Par():
                return self._par(part, before, failed)
            case If():
                return self._if(part, before, failed)
            case Fallback():
                return self._fallback(part, before, failed)
            case RetriedPart():
                return self._retried(part, before, failed)
            case StoppablePart():
                return self._stoppable(part, before, failed)
            case FailingPart():
                _merge(failed, before)
                return {}

    def _fallback(
        self, part: Fallback[Step], before: SymbolicStates, failed: SymbolicStates
    ) -> SymbolicStates:
        done: SymbolicStates = {}
        for one in part.parts:
            lost: SymbolicStates = {}
            _merge(done, self.execute(one, before, lost))
            before = lost
        _merge(failed, before)
        return done

    def _retried(
        self, part: RetriedPart[Step], before: SymbolicStates, failed: SymbolicStates
    ) -> SymbolicStates:
        done: SymbolicStates = {}
        for _ in range(part.retry + 1):
            lost: SymbolicStates = {}
            _merge(done, self.execute(part.part, before, lost))
            if lost.keys() == before.keys():
                break  # each further try begins and ends as this one
            before = lost
        _merge(failed, lost)
        return done

    def _stoppable(
        self, part: StoppablePart[Step], before: SymbolicStates, failed: SymbolicStates
    ) -> SymbolicStates:
        freed: set[str] = set()
        if isinstance(part, HeldPart):
            condition = part.condition.term
            before, unheld = self._decide(condition, before)
            _merge(failed, unheld)
            freed = {
                name for name, one in t.variables_of(condition).items() if one.role is t.VariableRole.STATE
            }
            freed |= disturbed_by_changes(freed, self.definitions).keys()
            self._held.append(condition)
        lost: SymbolicStates = {}
        self._stops.append(dict(before))
        done = self.execute(part.part, before, lost)
        stops = self._stops.pop()
        if isinstance(part, HeldPart):
            self._held.pop()
        _merge(failed, lost)
        for situation, trace in stops.items():
            failed.setdefault(self._forget_measurements(situation, freed), trace)
        if self._is_recording:
            _merge(self.states_after_parts.setdefault(id(part), {}), done)
        return done

    def _par(self, part: Par[Step], before: SymbolicStates, failed: SymbolicStates) -> SymbolicStates:
        kept: SymbolicStates = {}
        for situation, trace in before.items():
            kept.setdefault(self._forget_measurements(situation), trace)
        written = [self._writes(branch) for branch in part.branches]
        for stops in self._stops:
            for situation, trace in kept.items():
                stops.setdefault(self._forget_measurements(situation, frozenset().union(*written)), trace)
        # What the other branches have done decides, too, if a condition around all of them holds.
        around, self._stops, self._held = (self._stops, self._held), [], []
        self._depth += 1
        ended: SymbolicStates = {}
        for number, branch in enumerate(part.branches):
            lost: SymbolicStates = {}
            self.execute(branch, kept, lost)
            others = frozenset().union(*written[:number], *written[number + 1 :])
            for situation, trace in lost.items():
                ended.setdefault(self._forget_measurements(situation, others), trace)
        was_recording, self._is_recording = self._is_recording, False
        for branch in part.branches:
            kept = self.execute(branch, kept, {})
        self._is_recording = was_recording
        self._depth -= 1
        self._stops, self._held = around
        _merge(failed, self._still_held(ended))
        return self._still_held(kept)

    def _writes(self, branch: Part) -> frozenset[str]:
        """Names of all that the steps of a branch, their handlers included, may set or disturb."""
        steps = [run for one in steps_of(branch) for run in (one, *handlers_of(one, self.handlers))]
        skills = [self.skills[name] for step in steps for name in step.runs]
        outcomes = [one for skill in skills for one in skill.outcomes.values()]
        ranged = (bound.variable for one in outcomes for bound in one.ranges)
        return frozenset(ranged).union(
            *(one.effects for one in outcomes),
            *(one.consequences for one in outcomes),
            *(skill.disturbed for skill in skills),
        )

    def _if(self, part: If[Step], before: SymbolicStates, failed: SymbolicStates) -> SymbolicStates:
        if self._is_recording:
            _merge(self.states_at_ifs.setdefault(id(part), {}), before)
        then, otherwise = self._decide(part.condition, before)
        after = dict(self.execute(part.then, then, failed))
        if part.otherwise is not None:
            _merge(after, self.execute(part.otherwise, otherwise, failed))
        return after

    def _step(self, step: Step, before: SymbolicStates, name: str, failed: SymbolicStates) -> SymbolicStates:
        done: SymbolicStates = {}
        lost: SymbolicStates = {}
        tried: set[SymbolicState] = set()
        for tries_left in range(step.retry, -1, -1):
            # A situation that was tried before leads to nothing new.
            before = {situation: trace for situation, trace in before.items() if situation not in tried}
            tried.update(before)
            self._record_visit(name, before)
            before = self._run(step, before, done)
            # Any try may be the last: the agent's memory may leave out those that are left.
            _merge(lost, before)
            if tries_left and before and step.between_tries is not None:
                handler = self.handlers[step.between_tries]
                before = self._step(handler, before, f"handler/{step.between_tries}", lost)
        if lost and step.last_handler is not None:
            before, lost = lost, {}
            handler = self.handlers[step.last_handler]
            _merge(lost, self._step(handler, before, f"handler/{step.last_handler}", lost))
        _merge(failed, lost)
        return done


def _measured_instead(skill: Skill, outcome: Outcome) -> Iterator[Outcome]:
    """Yield outcomes with more effects that are measured in place of one if their effects hold, too.

    That is a failure that is declared impossible, if its effects hold already, and any outcome with an effect
    on what this one leaves at either value.
    """
    for one in skill.outcomes.values():
        if (one.failure and one.effect_count > outcome.effect_count and one.probability == 0) or (
            outcome.id in skill.outcomes
            and not one.effects.keys().isdisjoint(outcome.unsettled)
            and (one.effect_count, not one.failure) > (outcome.effect_count, not outcome.failure)
        ):
            yield one


def _with_effects(outcome: Outcome, effects: Mapping[str, Any]) -> Outcome:
    left = {name: value for name, value in outcome.consequences.items() if name not in effects}
    return replace(outcome, effects=effects, consequences=left)


def _may_hold(outcome: Outcome, before: SymbolicState, after: SymbolicState) -> bool:
    """Say if the effects of an outcome may be measured after a step; what is not assigned has any value."""
    wanted, found = _assigned_after(dict(before.assignment), outcome.effects), dict(after.assignment)
    return all(
        name not in found
        or isinstance(wanted[name], Increment) is not isinstance(found[name], Increment)
        or wanted[name] == found[name]
        for name in outcome.effects
    )


def _assigned_after(assigned: Mapping[str, Any], effects: Mapping[str, Any]) -> dict[str, Any]:
    """Apply effects to assigned values; an increment of a value at the start adds to the earlier ones."""
    after = dict(assigned)
    for name, effect in effects.items():
        known = after.get(name)
        if not isinstance(effect, Increment) or known is None:
            after[name] = effect
        elif isinstance(known, Increment):
            after[name] = Increment(known.amount + effect.amount)
        else:
            after[name] = known + effect.amount
    return after


def explore_paths(
    composition: Composition,
    skills: Mapping[str, Skill],
    state: Mapping[str, Declared],
    definitions: Definitions | None = None,
) -> PathExploration:
    """Explore all paths of a composition, from every state that meets its precondition.

    Assumes that no handler leads back to itself (`handler_cycle`).

    Args:
        composition: the composition.
        skills: skills of the module by name.
        state: state variables of the site by name.
        definitions: definitions of predicates by full name; None for none.

    Returns:
        The situations at every step and `if`, and after the whole.

    Raises:
        TooManyPathsError: there are more than `MAX_SYMBOLIC_STATES` situations.
    """
    paths = PathExploration(skills, state, composition.handlers, definitions=definitions or {})
    start = SymbolicState(path_condition=split_conjunction(fold_constants(composition.precondition)))
    paths.final_states = paths.execute(composition.body, {start: ()}, {})
    return paths


def earlier_measurements(terms: Iterable[t.Term], state: Mapping[str, Declared]) -> tuple[Declared, ...]:
    """Declare the variables for earlier measurements, such as `human_distance@1`, that terms mention.

    Args:
        terms: conditions on a path.
        state: state variables of the site by name.

    Returns:
        A declaration for each of them, with the range and unit of the measured variable.
    """
    variables = {name: one for term in terms for name, one in t.variables_of(term).items() if "@" in name}
    return tuple(replace(state[name.partition("@")[0]], variable=one) for name, one in variables.items())


def fold_constants(term: t.Term) -> t.Term:
    """Replace a term that does not depend on any variable by its value.

    Args:
        term: the term.

    Returns:
        The literal, or `term` itself where a variable matters.
    """
    decided = lower(term)
    return decided if isinstance(decided, t.Literal) else term


def split_conjunction(term: t.Term) -> frozenset[t.Term]:
    """Split a conjunction into its conditions.

    Args:
        term: a condition.

    Returns:
        The conjuncts other than `true`; `term` alone if it is not a conjunction.
    """
    parts = term.operands if isinstance(term, t.And) else (term,)
    return frozenset(part for part in parts if part != t.TRUE)


def _merge(into: SymbolicStates, more: SymbolicStates) -> None:
    for situation, trace in more.items():
        into.setdefault(situation, trace)

"""Every path of outcomes through a composition, symbolically: from all states at once, none enumerated.

A situation is what is known at one point of a path.  Effects are constants, so the state there is the
state at the start with some variables replaced, and what was decided on the way is a set of
conditions on the state at the start.  Situations that agree are one, so paths that meet are walked once.

Predicates (truth values and enum members) change by declared effects alone, as in the closed loop.
Every other state variable is taken to change whenever a skill runs, so nothing known of it outlives a
skill: a guard such as `human_distance > 1 m` is known of the very next step alone.  What it was when it
was decided on goes on as `human_distance@1`: a path that was never possible does not become so.

Each branch of a `par` is walked by itself: where none writes what another reads or writes, which is a
claim of its own, no interleaving changes what it meets.  What follows the `par` is reached where all have
succeeded.  Beside another branch nothing is known of what is no predicate, for a skill may be running.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.types import BoolType, EnumType
from aeros.spec.flow.arguments import constant_term
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.hold_conditions import hold_loss_outcomes
from aeros.spec.model.model import Declared, Outcome, Skill
from aeros.spec.model.step_graph import If, Par, Seq

MAX_SYMBOLIC_STATES = 20_000

OutcomeTrace = tuple[str, ...]


class TooManyPathsError(Exception):
    """A composition has more than `MAX_SYMBOLIC_STATES` situations."""


@dataclass(frozen=True)
class SymbolicState:
    """What is known at one point: the values that were assigned, and conditions on the start."""

    assignment: frozenset[tuple[str, Any]] = frozenset()
    path_condition: frozenset[t.Term] = frozenset()

    def condition(self, term: t.Term, state: Mapping[str, Declared]) -> t.Term:
        """`term` here, as a condition on the state at the start; a literal where it is decided."""
        values = {name: constant_term(value, state[name].variable.type) for name, value in self.assignment}
        return fold_constants(t.substitute(term, values))


SymbolicStates = dict[SymbolicState, OutcomeTrace]
"""The situations at a point, each with the outcomes on one of the shortest ways there."""


@dataclass
class PathExploration:
    """What was met on the way through a composition.

    visits: by step or handler, the situations in which its skill is about to start.
    cases: by position of an `if` in its file, the situations in which it is decided.
    ends: the situations in which the whole has succeeded.
    """

    skills: Mapping[str, Skill]
    state: Mapping[str, Declared]
    handlers: Mapping[str, Step]
    states_at_steps: dict[str, SymbolicStates] = field(default_factory=dict)
    states_at_ifs: dict[int, SymbolicStates] = field(default_factory=dict)
    final_states: SymbolicStates = field(default_factory=dict)
    _count: int = 0
    _depth: int = 0
    _is_recording: bool = True

    @cached_property
    def settable(self) -> frozenset[str]:
        """What some skill brings about."""
        skills = self.skills.values()
        return frozenset(name for one in skills for o in one.outcomes.values() for name in o.effects)

    def execute(self, part: Part, before: SymbolicStates) -> SymbolicStates:
        """The situations in which `part` has succeeded, from those `before` it."""
        match part:
            case Step():
                return self._step(part, before, part.id)
            case Seq(parts=inner):
                for one in inner:
                    before = self.execute(one, before)
                return before
            case Par():
                return self._par(part, before)
            case If():
                return self._if(part, before)

    def _par(self, part: Par[Step], before: SymbolicStates) -> SymbolicStates:
        kept: SymbolicStates = {}
        for situation, trace in before.items():
            kept.setdefault(self._forget_measurements(situation), trace)
        self._depth += 1
        for branch in part.branches:
            self.execute(branch, kept)
        was_noting, self._is_recording = self._is_recording, False
        for branch in part.branches:
            kept = self.execute(branch, kept)
        self._is_recording = was_noting
        self._depth -= 1
        return kept

    def _if(self, part: If[Step], before: SymbolicStates) -> SymbolicStates:
        if self._is_recording:
            _merge(self.states_at_ifs.setdefault(part.span.start, {}), before)
        then: SymbolicStates = {}
        otherwise: SymbolicStates = {}
        for situation, trace in before.items():
            condition = situation.condition(part.condition, self.state)
            for taken, term in ((then, condition), (otherwise, fold_constants(t.Not(condition)))):
                if term != t.FALSE:
                    known = SymbolicState(
                        situation.assignment, situation.path_condition | split_conjunction(term)
                    )
                    taken.setdefault(self._forget_measurements(known) if self._depth else known, trace)
        after = dict(self.execute(part.then, then))
        if part.otherwise is not None:
            _merge(after, self.execute(part.otherwise, otherwise))
        return after

    def _step(self, step: Step, before: SymbolicStates, name: str) -> SymbolicStates:
        done: SymbolicStates = {}
        tried: set[SymbolicState] = set()
        for tries_left in range(step.retry, -1, -1):
            # Of a situation that was tried before, everything that follows is known already.
            before = {situation: trace for situation, trace in before.items() if situation not in tried}
            tried.update(before)
            self._record_visit(name, before)
            before = self._run(step, before, done)
            if tries_left and before and step.handler is not None:
                before = self._step(self.handlers[step.handler], before, f"handler/{step.handler}")
        return done

    def _run(self, step: Step, before: SymbolicStates, done: SymbolicStates) -> SymbolicStates:
        """The situations after a failure; those after a success are added to `done`."""
        failed: SymbolicStates = {}
        skill = self.skills[step.skill]
        declared = [one for one in skill.outcomes.values() if one.probability != 0]
        for outcome in (*declared, *hold_loss_outcomes(skill, self.settable)):
            for situation, trace in before.items():
                after = self._apply_outcome(situation, outcome)
                (failed if outcome.failure else done).setdefault(after, (*trace, f"{step.id} → {outcome.id}"))
        return failed

    def _apply_outcome(self, situation: SymbolicState, outcome: Outcome) -> SymbolicState:
        before = self._forget_measurements(situation)
        assigned = frozenset({**dict(before.assignment), **outcome.effects}.items())
        after = SymbolicState(assigned, before.path_condition)
        return self._forget_measurements(after) if self._depth else after

    def _forget_measurements(self, situation: SymbolicState) -> SymbolicState:
        """What is known of `situation` once a skill has run: all else was measured earlier, as `NAME@1`."""
        known = {name: one for term in situation.path_condition for name, one in t.variables_of(term).items()}
        number = 1 + max((int(name.partition("@")[2]) for name in known if "@" in name), default=0)
        earlier: dict[str, t.Term] = {
            name: replace(one, name=f"{name}@{number}")
            for name, one in known.items()
            if one.role is t.VariableRole.STATE and not self._is_persistent(name)
        }
        return SymbolicState(
            frozenset((name, value) for name, value in situation.assignment if self._is_persistent(name)),
            frozenset(t.substitute(term, earlier) for term in situation.path_condition)
            if earlier
            else situation.path_condition,
        )

    def _is_persistent(self, name: str) -> bool:
        """Whether a state variable is a predicate, which declared effects alone change, or past."""
        return "@" in name or isinstance(self.state[name].variable.type, BoolType | EnumType)

    def _record_visit(self, name: str, situations: SymbolicStates) -> None:
        self._count += len(situations)
        if self._count > MAX_SYMBOLIC_STATES:
            raise TooManyPathsError
        if self._is_recording:
            _merge(self.states_at_steps.setdefault(name, {}), situations)


def explore_paths(
    composition: Composition, skills: Mapping[str, Skill], state: Mapping[str, Declared]
) -> PathExploration:
    """All paths of `composition`, from every state that meets its precondition.

    Assumes that its handlers lead back to none of themselves.  Raises `TooManyPathsError`.
    """
    paths = PathExploration(skills, state, composition.handlers)
    start = SymbolicState(path_condition=split_conjunction(fold_constants(composition.precondition)))
    paths.final_states = paths.execute(composition.body, {start: ()})
    return paths


def earlier_measurements(terms: Iterable[t.Term], state: Mapping[str, Declared]) -> tuple[Declared, ...]:
    """What `terms` say was measured earlier on the path."""
    found = {name: one for term in terms for name, one in t.variables_of(term).items() if "@" in name}
    return tuple(replace(state[name.partition("@")[0]], variable=one) for name, one in found.items())


def fold_constants(term: t.Term) -> t.Term:
    """`term`, or the literal that it is where no variable matters."""
    decided = lower(term)
    return decided if isinstance(decided, t.Literal) else term


def split_conjunction(term: t.Term) -> frozenset[t.Term]:
    """The conditions that `term` is the conjunction of."""
    parts = term.operands if isinstance(term, t.And) else (term,)
    return frozenset(part for part in parts if part != t.TRUE)


def _merge(into: SymbolicStates, more: SymbolicStates) -> None:
    for situation, trace in more.items():
        into.setdefault(situation, trace)

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
from aeros.spec.flow.arguments import constant
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.hold_conditions import unheld
from aeros.spec.model.model import Declared, Outcome, Skill
from aeros.spec.model.step_graph import If, Par, Seq

MAX_SITUATIONS = 20_000

Trace = tuple[str, ...]


class TooManyPathsError(Exception):
    """A composition has more than `MAX_SITUATIONS` situations."""


@dataclass(frozen=True)
class Situation:
    """What is known at one point: the values that were assigned, and conditions on the start."""

    assigned: frozenset[tuple[str, Any]] = frozenset()
    assumed: frozenset[t.Term] = frozenset()

    def condition(self, term: t.Term, state: Mapping[str, Declared]) -> t.Term:
        """`term` here, as a condition on the state at the start; a literal where it is decided."""
        values = {name: constant(value, state[name].variable.type) for name, value in self.assigned}
        return folded(t.substitute(term, values))


Situations = dict[Situation, Trace]
"""The situations at a point, each with the outcomes on one of the shortest ways there."""


@dataclass
class Paths:
    """What was met on the way through a composition.

    visits: by step or handler, the situations in which its skill is about to start.
    cases: by position of an `if` in its file, the situations in which it is decided.
    ends: the situations in which the whole has succeeded.
    """

    skills: Mapping[str, Skill]
    state: Mapping[str, Declared]
    handlers: Mapping[str, Step]
    visits: dict[str, Situations] = field(default_factory=dict)
    cases: dict[int, Situations] = field(default_factory=dict)
    ends: Situations = field(default_factory=dict)
    _count: int = 0
    _depth: int = 0
    _is_noting: bool = True

    @cached_property
    def settable(self) -> frozenset[str]:
        """What some skill brings about."""
        skills = self.skills.values()
        return frozenset(name for one in skills for o in one.outcomes.values() for name in o.effects)

    def walk(self, part: Part, before: Situations) -> Situations:
        """The situations in which `part` has succeeded, from those `before` it."""
        match part:
            case Step():
                return self._step(part, before, part.id)
            case Seq(parts=inner):
                for one in inner:
                    before = self.walk(one, before)
                return before
            case Par():
                return self._par(part, before)
            case If():
                return self._if(part, before)

    def _par(self, part: Par[Step], before: Situations) -> Situations:
        kept: Situations = {}
        for situation, trace in before.items():
            kept.setdefault(self._lasting(situation), trace)
        self._depth += 1
        for branch in part.branches:
            self.walk(branch, kept)
        was_noting, self._is_noting = self._is_noting, False
        for branch in part.branches:
            kept = self.walk(branch, kept)
        self._is_noting = was_noting
        self._depth -= 1
        return kept

    def _if(self, part: If[Step], before: Situations) -> Situations:
        if self._is_noting:
            _merge(self.cases.setdefault(part.span.start, {}), before)
        then: Situations = {}
        otherwise: Situations = {}
        for situation, trace in before.items():
            condition = situation.condition(part.condition, self.state)
            for taken, term in ((then, condition), (otherwise, folded(t.Not(condition)))):
                if term != t.FALSE:
                    known = Situation(situation.assigned, situation.assumed | conjuncts(term))
                    taken.setdefault(self._lasting(known) if self._depth else known, trace)
        after = dict(self.walk(part.then, then))
        if part.otherwise is not None:
            _merge(after, self.walk(part.otherwise, otherwise))
        return after

    def _step(self, step: Step, before: Situations, name: str) -> Situations:
        done: Situations = {}
        tried: set[Situation] = set()
        for tries_left in range(step.retry, -1, -1):
            # Of a situation that was tried before, everything that follows is known already.
            before = {situation: trace for situation, trace in before.items() if situation not in tried}
            tried.update(before)
            self._visit(name, before)
            before = self._run(step, before, done)
            if tries_left and before and step.handler is not None:
                before = self._step(self.handlers[step.handler], before, f"handler/{step.handler}")
        return done

    def _run(self, step: Step, before: Situations, done: Situations) -> Situations:
        """The situations after a failure; those after a success are added to `done`."""
        failed: Situations = {}
        skill = self.skills[step.skill]
        declared = [one for one in skill.outcomes.values() if one.probability != 0]
        for outcome in (*declared, *unheld(skill, self.settable)):
            for situation, trace in before.items():
                after = self._after(situation, outcome)
                (failed if outcome.failure else done).setdefault(after, (*trace, f"{step.id} → {outcome.id}"))
        return failed

    def _after(self, situation: Situation, outcome: Outcome) -> Situation:
        before = self._lasting(situation)
        assigned = frozenset({**dict(before.assigned), **outcome.effects}.items())
        after = Situation(assigned, before.assumed)
        return self._lasting(after) if self._depth else after

    def _lasting(self, situation: Situation) -> Situation:
        """What is known of `situation` once a skill has run: all else was measured earlier, as `NAME@1`."""
        known = {name: one for term in situation.assumed for name, one in t.variables_of(term).items()}
        number = 1 + max((int(name.partition("@")[2]) for name in known if "@" in name), default=0)
        earlier: dict[str, t.Term] = {
            name: replace(one, name=f"{name}@{number}")
            for name, one in known.items()
            if one.role is t.Role.STATE and not self._lasts(name)
        }
        return Situation(
            frozenset((name, value) for name, value in situation.assigned if self._lasts(name)),
            frozenset(t.substitute(term, earlier) for term in situation.assumed)
            if earlier
            else situation.assumed,
        )

    def _lasts(self, name: str) -> bool:
        """Whether a state variable is a predicate, which declared effects alone change, or past."""
        return "@" in name or isinstance(self.state[name].variable.type, BoolType | EnumType)

    def _visit(self, name: str, situations: Situations) -> None:
        self._count += len(situations)
        if self._count > MAX_SITUATIONS:
            raise TooManyPathsError
        if self._is_noting:
            _merge(self.visits.setdefault(name, {}), situations)


def paths_of(composition: Composition, skills: Mapping[str, Skill], state: Mapping[str, Declared]) -> Paths:
    """All paths of `composition`, from every state that meets its precondition.

    Assumes that its handlers lead back to none of themselves.  Raises `TooManyPathsError`.
    """
    paths = Paths(skills, state, composition.handlers)
    start = Situation(assumed=conjuncts(folded(composition.precondition)))
    paths.ends = paths.walk(composition.body, {start: ()})
    return paths


def earlier_in(terms: Iterable[t.Term], state: Mapping[str, Declared]) -> tuple[Declared, ...]:
    """What `terms` say was measured earlier on the path."""
    found = {name: one for term in terms for name, one in t.variables_of(term).items() if "@" in name}
    return tuple(replace(state[name.partition("@")[0]], variable=one) for name, one in found.items())


def folded(term: t.Term) -> t.Term:
    """`term`, or the literal that it is where no variable matters."""
    decided = lower(term)
    return decided if isinstance(decided, t.Literal) else term


def conjuncts(term: t.Term) -> frozenset[t.Term]:
    """The conditions that `term` is the conjunction of."""
    parts = term.operands if isinstance(term, t.And) else (term,)
    return frozenset(part for part in parts if part != t.TRUE)


def _merge(into: Situations, more: Situations) -> None:
    for situation, trace in more.items():
        into.setdefault(situation, trace)

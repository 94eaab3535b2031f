"""Small random planning problems, and their exact answers from going through every state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import Ecm, Outcome, Skill, TaskInvariant
from aeros.spec.model.site import Site
from tests.unit.agent.dumplings import PREDICATES, SPAN, module, site, skill, term

NAMES = PREDICATES[:4]
_LITERALS = [*NAMES, *NAMES, *(f"not {name}" for name in NAMES), "area == pot"]
_EFFECTS: list[dict[str, Any]] = [
    {},
    *({name: True} for name in NAMES),
    *({name: False} for name in NAMES),
    {"area": "pot"},
    {"area": "table"},
]

Values = frozenset[tuple[str, Any]]
"""Known values of a state; a variable that it does not name is unknown."""


@dataclass(frozen=True)
class Problem:
    """A goal for the skills of one module, and what is known at the start."""

    ecm: Ecm
    site: Site
    goal: t.Term
    invariants: tuple[TaskInvariant, ...]
    start: Mapping[str, Any]


@st.composite
def _skills(draw: st.DrawFn, number: int) -> Skill:
    effects = st.sampled_from(_EFFECTS)
    target = draw(st.sampled_from(NAMES))
    outcomes = [Outcome("done", {target: True} | draw(st.just({}) | effects), False, None, None)]
    for at, failure in enumerate(draw(st.lists(st.sampled_from([True, True, False]), max_size=2))):
        outcomes.append(
            Outcome(f"other_{at}", draw(effects) | draw(st.just({}) | effects), failure, None, None)
        )
    if len(outcomes) > 1 and draw(st.integers(0, 9)) == 0:
        outcomes[-1] = Outcome("never", outcomes[-1].effects, outcomes[-1].failure, Fraction(0), None)
    parts = draw(st.lists(st.sampled_from(_LITERALS), max_size=2, unique=True))
    condition = draw(st.sampled_from([" and ", " and ", " or "])).join(parts) or None
    return skill(f"skill_{number}", *outcomes, precondition=condition)


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """A start, a goal and up to six skills; some starts are not wholly known, some states forbidden."""
    skills = tuple(draw(_skills(number)) for number in range(draw(st.integers(1, 6))))
    goal = " and ".join(draw(st.lists(st.sampled_from(_LITERALS), min_size=1, max_size=2, unique=True)))
    known = [True] * 6 + [False]
    start: dict[str, Any] = {
        name: draw(st.sampled_from([False, False, True])) for name in NAMES if draw(st.sampled_from(known))
    }
    if draw(st.sampled_from(known)):
        start["area"] = draw(st.sampled_from(["table", "pot"]))
    texts = draw(
        st.just([])
        | st.lists(st.sampled_from([f"not ({a} and {b})" for a in NAMES for b in NAMES]), max_size=1)
    )
    kept = tuple(TaskInvariant(f"kept_{at}", term(text), text, SPAN) for at, text in enumerate(texts))
    return Problem(module("small", skills), site(), term(goal), kept, start)


@dataclass
class Enumeration:
    """Every state that can be reached, and the greatest part of it that no outcome leads out of hope.

    Written from the definitions, over values of all that is measured; shares nothing with
    `aeros.spec.planning`.
    """

    problem: Problem

    def ways(self, state: Values) -> Iterator[list[tuple[Values, bool]]]:
        """Of each skill that can start, the states it may end in and whether it has then failed."""
        for one in self.problem.ecm.skills.values():
            if one.precondition is None or self.holds(one.precondition.term, state):
                yield self.ends(one, state)

    def ends(self, one: Skill, state: Values) -> list[tuple[Values, bool]]:
        return [
            (then, self._has_failed(one, dict(then)))
            for outcome in one.outcomes.values()
            if outcome.probability != 0
            for then in [frozenset({**dict(state), **outcome.effects}.items())]
        ]

    def holds(self, condition: t.Term, state: Values) -> bool:
        values = dict(state)
        return all(name in values for name in t.variables_of(condition)) and is_true(condition, values)

    def is_forbidden(self, state: Values) -> bool:
        return any(
            t.variables_of(one.term).keys() <= dict(state).keys() and not is_true(one.term, dict(state))
            for one in self.problem.invariants
        )

    def _has_failed(self, one: Skill, after: Mapping[str, Any]) -> bool:
        shown = [o for o in one.outcomes.values() if all(after.get(n) == v for n, v in o.effects.items())]
        most = max(len(o.effects) for o in shown)
        return all(o.failure for o in shown if len(o.effects) == most)

    @cached_property
    def start(self) -> Values:
        return frozenset(self.problem.start.items())

    @cached_property
    def states(self) -> dict[Values, list[list[tuple[Values, bool]]]]:
        found: dict[Values, list[list[tuple[Values, bool]]]] = {}
        pending = [self.start]
        while pending:
            state = pending.pop()
            if state not in found:
                found[state] = list(self.ways(state))
                pending += [then for way in found[state] for then, _ in way]
        return found

    @cached_property
    def hopeful(self) -> set[Values]:
        """The greatest fixpoint: from each, skills that stay inside lead by successes to the goal."""
        inside = {state for state in self.states if not self.is_forbidden(state)}
        while (smaller := set(self.distances(inside))) != inside:
            inside = smaller
        return inside

    def distances(self, inside: set[Values]) -> dict[Values, int]:
        """The fewest successful steps to the goal by skills that never leave `inside`."""
        found = {state: 0 for state in inside if self.holds(self.problem.goal, state)}
        steps = 0
        while True:
            steps += 1
            new = [
                state
                for state in inside - found.keys()
                for way in self.states[state]
                if all(then in inside for then, _ in way)
                and any(then in found and not failed for then, failed in way)
            ]
            if not new:
                return found
            found |= dict.fromkeys(new, steps)

"""Claims about closed loops against a walk over every run, written from the agent's loop.

Shares with `tree_expansion` how plans are rejected and outcomes judged, and nothing with
`aeros.spec.closed_loop`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop import reachability
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import TaskInvariant
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.differential.planning.small_tasks import NAMES, START, Case, cases, loops, marking_loops
from tests.differential.planning.tree_expansion import State, _judged_a_failure, _shares, _Tree
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix
from tests.unit.agent.dumplings import PREDICATES, SPAN, term

SEEN, BY_SETS = Mix(), Mix()
_KEPT = st.sampled_from(
    [*NAMES, *(f"not {name}" for name in NAMES), f"{NAMES[0]} or not {NAMES[1]}", "area == table"]
)


class Place(NamedTuple):
    """Place of a run: what is measured, the rules still to be run, and what comes next."""

    state: State
    due: str  # a plan, the rest of one, the first try of its first step, another try, or a recovery
    rest: tuple[int, ...] = ()
    left: int = 0


@dataclass
class Walk:
    """Every run from every start; an edge without a chance is no way to the goal, but may do harm."""

    case: Case

    def __post_init__(self) -> None:
        self.tree = _Tree(self.case.ecm, self.case.task, self.case.site)
        self.edges: dict[Place, list[Place]] = {}
        self.hindered = False
        pending = [Place(start, "plan") for start in self.starts()]
        known = set(pending)
        while pending:
            place = pending.pop()
            ways = list(self.ways(place))
            self.edges[place] = [after for after, likely in ways if likely]
            fresh = {after for after, _ in ways} - known
            known |= fresh
            pending += fresh

    def starts(self) -> Iterator[State]:
        """Every state that agrees with `initial`."""
        free = [name for name in NAMES if name not in self.case.task.initial]
        for number in range(2 ** len(free)):
            chosen = {name: bool(number >> at & 1) for at, name in enumerate(free)}
            yield frozenset({**START, **self.case.task.initial, **chosen}.items())

    def ways(self, place: Place) -> Iterator[tuple[Place, bool]]:
        state, due, rest, left = place
        if self.is_goal(state):
            return
        rules = self.case.task.rules
        if due == "plan":
            plan = tuple(
                n for n, rule in enumerate(rules) if not is_true(rule.satisfied_condition, dict(state))
            )
            if not self.tree._is_rejected([rules[n] for n in plan]):
                yield Place(state, "rest", plan), True
            return
        if not rest:
            yield Place(state, "plan"), True
            return
        rule = rules[rest[0]]
        if due == "reset":
            ends = self.ends(rule.on_failure or "", {}, state)
            for after, likely, _ in [(state, True, False)] if ends is None else ends:
                yield Place(after, "plan"), likely
            return
        if due != "try again" and is_true(rule.satisfied_condition, dict(state)):
            yield Place(state, "rest", rest[1:]), True
        elif due == "rest":
            yield Place(state, "try", rest, rule.retry), True
        elif due == "recover":
            ends = None if rule.between_tries is None else self.ends(rule.between_tries, {}, state)
            for after, likely, _ in [(state, True, False)] if ends is None else ends:
                served = self.is_goal(after) or is_true(rule.satisfied_condition, dict(after))
                yield Place(after, "rest" if served else "try again", rest, left), likely
        else:
            ends = self.ends(rule.skill, rule.inputs, state)
            lost = "plan" if rule.on_failure is None else "reset"
            if ends is None:
                self.hindered |= due == "try"
                yield Place(state, "plan" if due == "try" else lost, rest), True
                return
            for after, likely, failed in ends:
                if not failed or is_true(rule.satisfied_condition, dict(after)):
                    yield Place(after, "rest", rest[1:]), likely
                elif left:
                    yield Place(after, "recover", rest, left - 1), likely
                    if lost == "reset":  # memory may leave out the tries that are left
                        yield Place(after, lost, rest), False
                else:
                    yield Place(after, lost, rest), likely

    def ends(self, name: str, given: Any, state: State) -> list[tuple[State, bool, bool]] | None:
        """Each state after it, whether it has a chance and is a failure; None where it does not start."""
        skill = self.case.ecm.skills[name]
        inputs = {f"inputs.{key}": given.get(key, one.default_value) for key, one in skill.inputs.items()}
        if skill.precondition is not None and not is_true(skill.precondition.term, {**dict(state), **inputs}):
            return None
        found = []
        for outcome, share in _shares(skill):
            if outcome.probability != 0:
                after = {**dict(state), **outcome.effects}
                found.append(
                    (frozenset(after.items()), share != 0, _judged_a_failure(skill, dict(state), after))
                )
        return found

    def is_goal(self, state: State) -> bool:
        return is_true(self.case.task.goal, dict(state))

    def stuck(self) -> bool:
        """Return true if some plan is due from which no run reaches the goal."""
        hopeful = {place for place in self.edges if self.is_goal(place.state)}
        while more := {
            place for place, ways in self.edges.items() if place not in hopeful and hopeful.intersection(ways)
        }:
            hopeful |= more
        return any(place.due == "plan" and place not in hopeful for place in self.edges)


@st.composite
def _judged(draw: st.DrawFn) -> Case:
    case = draw(cases(most_rules=3, most_retries=2, most_replans=0))
    named = draw(st.sets(st.sampled_from(NAMES)))
    initial = {name: case.start[name] for name in named} | {"area": "table"}
    return _keeping(replace(case, task=replace(case.task, initial=initial)), draw(_KEPT))


@st.composite
def _turning(draw: st.DrawFn) -> Case:
    """Of a loop that does something, what its later turns may break."""
    case = draw(st.one_of(loops(), loops(), loops(), marking_loops()))
    some = draw(st.lists(st.sampled_from(PREDICATES), min_size=2, max_size=3, unique=True))
    each = [f"not {name}" for name in PREDICATES if not case.task.initial[name]]
    first, second, *_ = PREDICATES
    ordered = [f"{first} or not {name}" for name in PREDICATES[1:]] + [f"{second} or not {some[0]}"]
    return _keeping(case, f"not ({' and '.join(some)})", "area == table", *each, *ordered)


def _keeping(case: Case, *kept: str) -> Case:
    invariants = tuple(TaskInvariant(f"kept_{at}", term(one), one, SPAN) for at, one in enumerate(kept))
    task = replace(case.task, invariants=invariants)
    return replace(case, task=task, ecm=replace(case.ecm, tasks={task.id: task}))


def test_a_loop_is_refused_exactly_where_some_run_goes_wrong() -> None:
    _loops_are_judged()
    SEEN.assert_both("AE801", "AE802", "AE804", "AE805")


def test_so_it_is_where_there_are_too_many_states_to_list(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reachability, "MAX_STARTS", 0)
    _loops_are_judged_by_sets()
    BY_SETS.assert_both("AE801", "AE802", "AE804", "AE805", at_least=2)


@examples(150)
@given(_judged() | _turning() | _turning())
def _loops_are_judged(case: Case) -> None:
    _judge(case, list(closed_loop_obligations(case.ecm, case.site)), SEEN)


@examples(180)
@given(_judged() | _turning() | _turning())
def _loops_are_judged_by_sets(case: Case) -> None:
    listed = list(closed_loop_obligations(case.ecm, case.site))
    _judge(case, listed, BY_SETS)
    claims = [one for one in listed if isinstance(one, Obligation)]
    faults = [one for one in listed if isinstance(one, StaticClaim) and one.diagnostic is not None]
    assert bool(claims) is not bool(faults)
    assert all(one.verdict is Verdict.PROVED for one in discharge_obligations(claims))


def _judge(case: Case, listed: list[Obligation | StaticClaim], seen: Mix) -> None:
    found = {str(one.id).split("/", 2)[2]: one.diagnostic for one in listed if isinstance(one, StaticClaim)}
    walk = Walk(case)
    expected = {
        "dispatch": ("AE801", not walk.hindered),
        "progress": ("AE802", not walk.stuck()),
        "effective": ("AE805", not all(walk.is_goal(start) for start in walk.starts())),
    }
    states = [dict(state) for state in {place.state for place in walk.edges}]
    for kept in case.task.invariants:
        expected[f"invariant/{kept.id}"] = "AE804", all(is_true(kept.term, state) for state in states)
    assert found.keys() == expected.keys()
    for claim, (code, right) in expected.items():
        diagnostic = found[claim]
        assert diagnostic is None or diagnostic.code == code
        seen.compare(code, proved=diagnostic is None, expected=right)

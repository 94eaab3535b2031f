"""Programs of tasks: their places, in order, and what has none."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic import builder
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.builder import build_program
from aeros.spec.closed_loop.symbolic.program import PLAN, Place
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Outcome
from tests.differential.planning.number_loops import term
from tests.unit.agent.dumplings import outcome, rule, skill
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import COOKED, COOKING, WRAPPED, WRAPPING, loop


def test_a_place_comes_after_those_that_its_moves_lead_to() -> None:
    handled = rule(WRAPPED, "wrap", 2, "boil", "boil")
    moves = build_program(loop(handled, COOKING).system).moves
    places = list(moves)
    for at, place in enumerate(places):
        for move in moves[place]:
            for branch in move.branches:
                assert all(end.target == PLAN or end.target in places[:at] for end in branch.ends)
    assert places[-1] == PLAN
    assert {place.kind for place in places} >= {"try", "recover", "reset", "reached", "rejected", "plan"}


def test_each_try_has_a_place() -> None:
    program = build_program(loop(rule(WRAPPED, "wrap", 2), COOKING).system)
    tries = [place for place in program.moves if place.kind == "try" and place.rule == 0]
    assert sorted(place.tries for place in tries) == [0, 1, 2]
    assert Place("try", 2) in program.moves
    assert len(program.first_tries) == 2


def test_a_variable_of_a_rule_follows_what_decides_it() -> None:
    program = build_program(loop(COOKING, WRAPPING).system)
    first, second = program.plan_bits
    assert list(program.values) == [COOKED, first, WRAPPED, second]


def test_plans_that_are_always_rejected_lead_nowhere() -> None:
    # A failure of `wrap` is handled by `wrap`.
    made = loop(rule(WRAPPED, "wrap", 0, None, "wrap"), COOKING)
    path = made.dead_end()
    assert path is not None
    assert made.system.rejection(made.system.plan(path.end)) == "a failure leads back to itself"


def test_a_circle_over_several_rules_is_found() -> None:
    made = loop(rule(WRAPPED, "wrap", 0, None, "boil"), rule(COOKED, "boil", 0, None, "wrap"))
    path = made.dead_end()
    assert path is not None
    assert path.end == (False, False)


@pytest.mark.parametrize(
    ("limit", "value", "message"),
    [
        ("MAX_PLACES", 5, "its compositions have too many steps and tries"),
        ("MAX_PLAN_STEPS", 1, "it has more than 1 rules"),
        ("MAX_CYCLES", 0, "its failures lead back to themselves in too many ways"),
    ],
)
def test_a_program_has_limits(limit: str, value: int, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(builder, limit, value)
    looped = rule(WRAPPED, "wrap", 0, None, "wrap")
    with pytest.raises(StateSpaceError, match=f"^{message}$"):
        build_program(loop(looped, COOKING).system)


def test_limits_are_the_largest_numbers_that_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    system = loop(rule(WRAPPED, "wrap", 0, None, "wrap"), COOKING).system
    monkeypatch.setattr(builder, "MAX_PLACES", len(build_program(system).moves))
    monkeypatch.setattr(builder, "MAX_PLAN_STEPS", 2)
    # The rule alone is rejected, and the one circle is through it.
    monkeypatch.setattr(builder, "MAX_CYCLES", 2)
    assert build_program(system).moves
    for limit in ("MAX_PLACES", "MAX_PLAN_STEPS", "MAX_CYCLES"):
        with monkeypatch.context() as patched:
            patched.setattr(builder, limit, getattr(builder, limit) - 1)
            with pytest.raises(StateSpaceError):
                build_program(system)


def test_a_skill_is_described_once_for_the_same_inputs() -> None:
    made = builder._Builder(loop().system)
    assert made.skill("wrap", {}) is made.skill("wrap", {})
    assert made.skill("boil", {}) is not made.skill("wrap", {})
    assert made.skill("wrap", {"force": 1}) is not made.skill("wrap", {})
    assert made.skill("wrap", {"force": 1}) is made.skill("wrap", {"force": 1})


def test_a_program_has_what_the_task_says() -> None:
    made = loop(COOKING, WRAPPING, goal=f"{COOKED} and {WRAPPED}", kept=f"{WRAPPED} or not {COOKED}")
    program = made.program
    assert program.goal == term(f"{COOKED} and {WRAPPED}")
    assert program.invariants == {"kept": term(f"{WRAPPED} or not {COOKED}")}
    assert program.breakpoints == made.system.variables.breakpoints
    due = [sorted(t.variables_of(condition)) for condition, _ in program.first_tries]
    first, second = program.plan_bits
    assert due == [sorted([COOKED, WRAPPED, first]), sorted([COOKED, WRAPPED, second])]
    assert [starts for _, starts in program.first_tries] == [[term(WRAPPED)], [t.TRUE]]


@pytest.mark.parametrize("handlers", [("cure", None), (None, "cure")])
def test_a_recovery_s_outcome_of_no_probability_is_no_way_to_the_goal(
    handlers: tuple[str | None, ...],
) -> None:
    def cooked_with(share: Fraction) -> SymbolicLoop:
        torn = skill("tear", outcome("torn", {}, failure=True))
        done = Outcome("done", {}, False, 1 - share, None)
        cure = skill("cure", done, Outcome("lucky", {COOKED: True}, False, share or None, None))
        return loop(rule(COOKED, "tear", 1, *handlers), skills=(torn, cure), initial={COOKED: False})

    assert cooked_with(Fraction(0)).dead_end() is not None
    assert cooked_with(Fraction(1, 9)).dead_end() is None

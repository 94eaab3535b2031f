"""Skills as the agent's loop sees them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop.invocation import Invocation, StateCondition
from aeros.spec.model.ecm import Outcome
from tests.unit.agent.dumplings import FORCE, outcome, skill, term

NAMES = ("area", "dumpling_cooked", "dumpling_wrapped", "wrapper_aligned")
HALF, QUARTER = Fraction(1, 2), Fraction(1, 4)


@pytest.mark.parametrize(
    ("text", "true", "false"),
    [
        ("dumpling_cooked", [("pot", True, False, False)], [("pot", False, True, True)]),
        ("dumpling_cooked and wrapper_aligned and dumpling_wrapped", [("pot", True, True, True)],
         [("pot", True, True, False), ("pot", False, True, True), ("pot", True, False, True)]),
        ("area == pot and not dumpling_wrapped", [("pot", True, False, True)],
         [("table", True, False, True), ("pot", True, True, True)]),
        ("dumpling_cooked or area == table", [("table", False, False, False), ("pot", True, False, False)],
         [("pot", False, True, True)]),
        ("true", [("pot", False, False, False)], []),
    ],
)  # fmt: skip
def test_a_condition_is_decided_by_the_predicates_of_a_state(
    text: str, true: list[tuple[Any, ...]], false: list[tuple[Any, ...]]
) -> None:
    condition = StateCondition(term(text), NAMES)
    for _ in range(2):  # the second time from the cache
        assert [condition(state) for state in (*true, *false)] == [True] * len(true) + [False] * len(false)


def test_a_condition_reads_constant_inputs() -> None:
    condition = term("dumpling_cooked and inputs.force > 0.4")
    state = ("pot", True, False, False)
    assert StateCondition(condition, NAMES, {"inputs.force": HALF})(state)
    assert not StateCondition(condition, NAMES, {"inputs.force": QUARTER})(state)


@pytest.mark.parametrize(
    ("text", "index"),
    [
        ("dumpling_wrapped", 2),
        ("area == pot", None),
        ("not dumpling_wrapped", None),
        ("dumpling_wrapped and dumpling_cooked", None),
        ("dumpling_wrapped and area == pot", None),
    ],
)
def test_only_a_predicate_alone_has_an_index(text: str, index: int | None) -> None:
    assert StateCondition(term(text), NAMES).single_predicate_index == index


def test_a_skill_starts_where_its_precondition_holds_with_given_or_default_inputs() -> None:
    press = skill(
        "press",
        outcome("done", {}),
        precondition="dumpling_wrapped and inputs.force > 0.4",
        inputs={"force": FORCE},
    )
    ready, other = ("pot", False, True, False), ("pot", False, False, False)
    assert Invocation(press, {}, NAMES).name == "press"
    assert [Invocation(press, {}, NAMES).can_start(state) for state in (ready, other)] == [True, False]
    assert not Invocation(press, {"force": QUARTER}, NAMES).can_start(ready)
    assert Invocation(replace(press, precondition=None), {}, NAMES).can_start(other)


def after(invocation: Invocation, state: tuple[Any, ...]) -> list[tuple[Any, ...]]:
    return [(*then, one.id, share) for then, one, share in invocation.after(state)]


def test_each_outcome_sets_its_effects_and_leaves_the_rest() -> None:
    boil = skill(
        "boil", outcome("cooked", {"dumpling_cooked": True, "area": "pot"}), outcome("cold", {}, failure=True)
    )
    assert after(Invocation(boil, {}, NAMES), ("table", False, True, False)) == [
        ("pot", True, True, False, "cooked", HALF),
        ("table", False, True, False, "cold", HALF),
    ]


def test_the_outcome_measured_has_the_most_effects_and_of_several_is_a_success() -> None:
    done = {"dumpling_cooked": True}
    boil = skill(
        "boil",
        outcome("burnt", done, failure=True),
        outcome("cooked", done),
        outcome("wrapped", {"dumpling_cooked": True, "dumpling_wrapped": True}, failure=True),
    )
    third = Fraction(1, 3)
    assert after(Invocation(boil, {}, NAMES), ("pot", False, False, False)) == [
        ("pot", True, False, False, "cooked", third),
        ("pot", True, False, False, "cooked", third),
        ("pot", True, True, False, "wrapped", third),
    ]


def test_an_outcome_declared_impossible_is_left_out_and_one_that_is_left_nothing_is_not() -> None:
    boil = skill(
        "boil",
        Outcome("cooked", {"dumpling_cooked": True}, False, Fraction(1), None),
        Outcome("never", {"area": "table"}, True, Fraction(0), None),
        outcome("open", {"dumpling_cooked": False}, failure=True),
    )
    assert after(Invocation(boil, {}, NAMES), ("pot", False, False, False)) == [
        ("pot", True, False, False, "cooked", Fraction(1)),
        ("pot", False, False, False, "open", Fraction(0)),
    ]


def test_a_broken_hold_condition_ends_the_skill_as_a_failure_of_probability_zero() -> None:
    boil = skill("boil", outcome("cooked", {"dumpling_cooked": True}), hold="dumpling_wrapped")
    state = ("pot", False, True, False)
    unheld = [
        row for row in after(Invocation(boil, {}, NAMES, {"dumpling_wrapped"}), state) if row[4] == "unheld"
    ]
    assert {row[:4] for row in unheld} == {
        ("pot", cooked, wrapped, False) for cooked in (False, True) for wrapped in (False, True)
    }
    assert {row[5] for row in unheld} == {0}
    # Nothing but the world sets it again, so it is taken to be as it was.
    alone = [row[:5] for row in after(Invocation(boil, {}, NAMES), state) if row[4] == "unheld"]
    assert alone == [("pot", False, True, False, "unheld"), ("pot", True, True, False, "unheld")]

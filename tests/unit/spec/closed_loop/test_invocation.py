"""Skills as the agent's loop sees them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop.definition_facts import OutcomeValues
from aeros.spec.closed_loop.invocation import Invocation, StateCondition, UnsettledError
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.hold_conditions import HOLD_LOST, STOPPED
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


def test_values_that_no_outcome_states_are_found_for_the_skill_and_its_outcome() -> None:
    """Also for the end of a lost hold-condition, and of a stop."""
    boil = skill(
        "boil", outcome("cooked", {"dumpling_cooked": True}), hold="dumpling_wrapped and not wrapper_aligned"
    )
    asked = []

    def find(of: Skill, one: Outcome) -> OutcomeValues:
        asked.append((of.id, one.id))
        return OutcomeValues({"area": ("table", "pot")}, {}, (term("not (area == pot and wrapper_aligned)"),))

    made = Invocation(boil, {}, NAMES, {"dumpling_wrapped"}, find)
    assert {name for name, _ in asked} == {"boil"}
    assert {one for _, one in asked} >= {"cooked", HOLD_LOST, STOPPED}
    assert made.unsettled == ""
    assert after(made, ("table", False, True, True))[:1] == [("table", True, True, True, "cooked", 1)]
    # Where several values are left, nothing decides between them.
    assert after(made, ("table", False, True, False))[:2] == [
        ("table", True, True, False, "cooked", HALF),
        ("pot", True, True, False, "cooked", HALF),
    ]
    assert made.unsettled == (
        "`area` may be several after `boil → cooked`: state it as an effect of that outcome"
    )
    assert not made.is_settled
    stopped = made.stopped(("table", False, True, False))
    assert len(set(stopped)) == len(stopped)
    assert {state[0] for state in stopped} == {"table", "pot"}
    assert not any(state[0] == "pot" and state[3] for state in stopped)


def test_values_that_nothing_decides_are_named_together() -> None:
    done = replace(outcome("done", {}), consequences={"dumpling_cooked": None, "dumpling_wrapped": None})
    made = Invocation(skill("boil", done), {}, NAMES)
    assert len(after(made, ("pot", False, False, False))) == 4
    assert made.unsettled == (
        "`dumpling_cooked`, `dumpling_wrapped` may be either after `boil → done`: "
        "state it as an effect of that outcome"
    )
    unknown = Invocation(skill("boil", done), {}, NAMES, has_unknown=True)
    assert after(unknown, ("pot", False, False, False)) == [("pot", None, None, False, "done", 1)]


def test_a_value_that_follows_is_computed_from_what_the_outcome_leaves() -> None:
    boil = skill("boil", outcome("done", {"area": "pot"}))
    values = OutcomeValues({}, {"dumpling_cooked": term("area == pot")}, ())
    made = Invocation(boil, {}, NAMES, (), lambda *_: values)
    assert after(made, ("table", False, False, False)) == [("pot", True, False, False, "done", 1)]


def test_too_many_values_after_an_outcome_are_refused() -> None:
    boil = skill("boil", outcome("done", {}))
    values = OutcomeValues({"area": ("table", "pot") * 64, "dumpling_cooked": (False, True)}, {}, ())
    made = Invocation(boil, {}, NAMES, (), lambda *_: values)
    assert len(after(made, ("pot", False, False, False))) == 256
    more = values._replace(opened={**values.opened, "dumpling_cooked": (False, True, None)})
    with pytest.raises(UnsettledError, match=r"^`boil` leaves 2 variables of it at any value$"):
        Invocation(boil, {}, NAMES, (), lambda *_: more)


@pytest.mark.parametrize("value", [False, True])
def test_after_an_outcome_its_consequences_hold_and_nothing_else_changes(value: bool) -> None:
    follows = {"dumpling_cooked": value, "wrapper_aligned": None, "m.elsewhere": True}
    wrap = skill("wrap", replace(outcome("wrapped", {"dumpling_wrapped": True}), consequences=follows))
    for before in (False, True):
        found = {after for after, _, _ in Invocation(wrap, {}, NAMES).after(("pot", before, False, before))}
        assert found == {("pot", value, True, aligned) for aligned in (False, True)}

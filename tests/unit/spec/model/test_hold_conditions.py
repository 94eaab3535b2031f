"""Hold-conditions: their part in the start condition, and the outcomes of a run that loses one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop.invocation import Invocation
from aeros.spec.closed_loop.loop_variables import LoopVariables
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import IntegerType
from aeros.spec.model.ecm import ActionCondition, Skill
from aeros.spec.model.hold_conditions import (
    HOLD_LOST,
    MAX_COMBINATIONS,
    count_combinations,
    hold_loss_outcomes,
    start_condition,
)
from aeros.spec.model.rules import Conjunct
from tests.differential.planning.number_loops import STATE
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, site, skill, task, term

INT = IntegerType()
BOTH = ("dough_on_workspace", "dumpling_wrapped")


def holding(hold: str, *outcomes: Any) -> Skill:
    return skill("carry", *outcomes, hold=hold)


def states(one: Skill, settable: Iterable[str]) -> list[dict[str, Any]]:
    ways = hold_loss_outcomes(one, set(settable))
    assert all(way.id == HOLD_LOST and way.failure and way.probability == 0 for way in ways)
    return [dict(way.effects) for way in ways]


def test_a_skill_without_a_hold_condition_is_not_halted() -> None:
    assert hold_loss_outcomes(skill("carry", outcome("carried", {})), set(BOTH)) == ()


def test_a_predicate_that_some_skill_sets_has_any_value_afterwards() -> None:
    assert states(holding("dough_on_workspace"), BOTH) == [
        {"dough_on_workspace": False},
        {"dough_on_workspace": True},
    ]


def test_a_predicate_that_no_skill_sets_stays_as_before() -> None:
    assert states(holding("dough_on_workspace"), ()) == [{}]


def test_effects_of_possible_outcomes_may_be_in_force_when_the_hold_condition_is_lost() -> None:
    never = outcome("never", {"wrapper_aligned": True})
    object.__setattr__(never, "probability", 0)
    one = holding("area == pot", outcome("cooked", {"dumpling_cooked": True}), never)
    assert states(one, ()) == [{}, {"dumpling_cooked": True}]


def test_values_of_the_hold_condition_override_effects() -> None:
    one = holding("area == pot", outcome("emptied", {"area": "table"}))
    assert states(one, ["area"]) == [{"area": "table"}, {"area": "pot"}]


def test_after_a_lost_hold_a_number_that_it_reads_may_be_unset_while_other_effects_are_set() -> None:
    one = holding("fill_level > 0.5", outcome("full", {"fill_level": 1, "dumpling_cooked": True}))
    full = {"fill_level": 1, "dumpling_cooked": True}
    assert states(one, [*full]) == [{}, full, {"dumpling_cooked": True}]


def test_after_a_lost_hold_the_loop_explores_every_count_with_and_without_the_other_effect() -> None:
    counting = skill("add", outcome("added", {"count": Fraction(1), "dumpling_cooked": True}))
    held = ActionCondition(t.Compare("<=", t.Literal(Fraction(0), INT), STATE["count"].variable), "", SPAN)
    one = replace(counting, hold_condition=held)
    ecm = module(
        "kitchen", (one,), task("cook", ("cook",), "dumpling_cooked", rule("dumpling_cooked", "add"))
    )
    found = LoopVariables(ecm, ecm.tasks["cook"], replace(site(), state=STATE))
    names = tuple(found.variables)
    assert names == ("count", "dumpling_cooked")
    after = Invocation(one, {}, names, names, found.after).after((Fraction(0), False))
    lost = {state for state, ended, _ in after if ended.id == HOLD_LOST}
    assert lost == {(count, cooked) for count in found.values["count"] for cooked in (False, True)}


def test_a_start_requires_the_predicates_of_the_hold_condition_but_not_its_quantities() -> None:
    parts = [clause("dumpling_wrapped"), clause("fill_level > 0.5"), clause("area == pot")]
    whole = ActionCondition(
        term("dumpling_wrapped and fill_level > 0.5 and area == pot"),
        "",
        SPAN,
        tuple(conjunct for part in parts for conjunct in part.conjuncts),
    )
    found = start_condition(clause("dough_on_workspace"), whole)
    assert found is not None
    assert found.term == term("dough_on_workspace and dumpling_wrapped and area == pot")
    assert start_condition(None, clause("fill_level > 0.5")) is None
    assert start_condition(clause("dough_on_workspace"), None) == clause("dough_on_workspace")


def clause(text: str) -> ActionCondition:
    return ActionCondition(term(text), text, SPAN, (Conjunct(term(text), SPAN),))


@pytest.mark.parametrize(
    ("text", "count"), [("fill_level > 0.5", 1), ("area == pot and dumpling_wrapped", 4)]
)
def test_combinations_are_those_of_predicates(text: str, count: int) -> None:
    assert count_combinations(clause(text)) == count <= MAX_COMBINATIONS


def test_the_closed_loop_provides_for_every_hold_loss_without_counting_on_one() -> None:
    one = holding("dough_on_workspace", outcome("carried", {"dumpling_wrapped": True}))
    after = Invocation(one, {}, BOTH, BOTH).after((True, False))
    assert [(state, ended.id, share) for state, ended, share in after] == [
        ((True, True), "carried", Fraction(1)),
        ((False, False), HOLD_LOST, Fraction(0)),
        ((True, False), HOLD_LOST, Fraction(0)),
        ((False, True), HOLD_LOST, Fraction(0)),
        ((True, True), HOLD_LOST, Fraction(0)),
    ]

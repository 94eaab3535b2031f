"""Values that follow for predicates by definition, and those that may be either."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

from aeros.spec.consequences.consequences import (
    modules_with_consequences,
    stated_terms,
    uncertain_predicates,
    value_that_follows,
    with_consequences,
)
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment, QuantityRange
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.hold_conditions import hold_loss_outcomes
from aeros.spec.model.perception import Definition
from tests.unit.agent.dumplings import SPAN, module, outcome
from tests.unit.spec.consequences.places import DEFINITIONS, STATE, asking, site, term


def settled(*skills: Skill) -> dict[str, Skill]:
    ecm = replace(module("m", skills), definitions=DEFINITIONS)
    return dict(with_consequences(ecm, site()).skills)


def consequences(effects: dict[str, Any], kinds: tuple[str, ...] = ("drive",)) -> dict[str, bool | None]:
    found = settled(asking("act", outcome("done", effects), kinds=kinds))["act"].outcomes["done"].consequences
    return {name: value for name, value in found.items() if name != "m.alone"}


def test_a_predicate_of_a_moved_reading_may_be_either_unless_an_effect_states_it() -> None:
    assert consequences({}) == {"m.docked": None, "m.far": None}
    assert consequences({"m.docked": True}) == {"m.far": None}  # the dock may be anywhere
    assert consequences({"m.docked": True, "m.far": True}) == {}
    assert consequences({}, kinds=("wait",)) == {}


def test_a_value_follows_from_effects_on_what_the_definition_reads() -> None:
    assert consequences({"holding": True}, kinds=("wait",)) == {"m.free": False}
    assert consequences({"holding": False}, kinds=("wait",)) == {"m.free": None}
    assert consequences({"holding": False, "m.count": Fraction(0)}, kinds=("wait",)) == {"m.free": True}
    assert consequences({"m.count": Increment(Fraction(1))}, kinds=("wait",)) == {"m.free": None}


def test_a_value_follows_from_a_range() -> None:
    there = replace(outcome("there", {}), ranges=(QuantityRange("base", None, Fraction(6), Fraction(7)),))
    assert value_that_follows("m.far", there, DEFINITIONS, STATE) is True
    assert value_that_follows("m.docked", there, DEFINITIONS, STATE) is None
    assert len(stated_terms(there, DEFINITIONS, STATE)) == 1


def test_a_value_is_not_that_which_another_outcome_states() -> None:
    went = asking("go", outcome("docked", {"m.docked": True}), outcome("blocked", {}, failure=True))
    assert settled(went)["go"].outcomes["blocked"].consequences["m.docked"] is False
    never = replace(went.outcomes["docked"], probability=Fraction(0))
    other = replace(went, outcomes={**went.outcomes, "docked": never})
    assert settled(other)["go"].outcomes["blocked"].consequences["m.docked"] is None


def test_effects_that_exclude_each_other_decide_nothing() -> None:
    nowhere: Outcome = outcome("nowhere", {"holding": True, "m.free": True})
    assert value_that_follows("m.alone", nowhere, DEFINITIONS, STATE) is None


def test_a_halted_skill_leaves_all_that_it_disturbs_at_either_value() -> None:
    hold = ActionCondition(term("holding"), "holding", SPAN)
    moving = replace(asking("carry", outcome("carried", {"m.far": True})), hold_condition=hold)
    (carry,) = settled(moving).values()
    for lost in hold_loss_outcomes(carry, ["holding"]):
        assert set(lost.unsettled) | lost.effects.keys() >= {"m.docked", "m.far", "m.free", "m.alone"}


def test_modules_that_are_active_together_know_the_predicates_of_each_other() -> None:
    alone = module("n", (asking("go", outcome("gone", {})),))
    other = replace(module("m", ()), definitions=DEFINITIONS)
    assert with_consequences(alone, site()) is alone
    found = modules_with_consequences({"n": alone, "m": other}, site())["n"].skills["go"]
    assert found.outcomes["gone"].consequences["m.docked"] is None
    assert found.disturbed["m.docked"] == "`base`"


def test_a_margin_makes_all_uncertain_that_is_read_from_it() -> None:
    def defined(name: str, margin: int = 0) -> Definition:
        read = t.Variable(name, BOOL, t.VariableRole.STATE)
        return Definition(read, name, SPAN, Fraction(margin))

    definitions = {"c": defined("b"), "b": defined("a"), "a": defined("seen", 2), "d": defined("seen")}
    assert uncertain_predicates(definitions) == {"a", "b", "c"}

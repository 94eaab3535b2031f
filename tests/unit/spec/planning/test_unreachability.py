"""Explanations of unreachable goals, from the goal backwards."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.model.ecm import Outcome, TaskInvariant
from aeros.spec.planning import unreachability
from aeros.spec.planning.domain import domain_for
from aeros.spec.planning.unreachability import unreachability_reasons
from tests.unit.agent.dumplings import SPAN, module, outcome, site, skill, term
from tests.unit.spec.planning.kitchen import BOIL, UNTOUCHED, WRAP, domain_of, reason


def test_conditions_that_no_skill_achieves_are_traced_back_from_the_goal() -> None:
    assert reason(domain_of(BOIL, WRAP)) == (
        "no plan reaches the goal: "
        "the goal needs `dumpling_cooked`, which only `kitchen.boil` could make true; "
        "`kitchen.boil` needs `dumpling_wrapped`, which only `kitchen.wrap` could make true; "
        "`kitchen.wrap` needs `dough_on_workspace`, which does not hold now, and no skill changes it"
    )


def test_an_unmeasured_variable_satisfies_nothing() -> None:
    known = {name: value for name, value in UNTOUCHED.items() if name != "dough_on_workspace"}
    message = reason(domain_of(BOIL, WRAP, known=known), known)
    assert message.endswith(
        "`dough_on_workspace`: `dough_on_workspace` is not measured, and no skill sets it"
    )


def test_a_broken_invariant_is_reported_first() -> None:
    kept = TaskInvariant("kept", term("not dumpling_cooked"), "", SPAN)
    domain = domain_for(
        {"kitchen": module("kitchen", (BOIL,))}, site(), UNTOUCHED, term("dumpling_cooked"), (kept,)
    )
    assert unreachability_reasons(domain, (True,)) == "the invariant `kept` does not hold there"


def test_where_the_parts_could_be_had_one_by_one_the_order_is_to_blame() -> None:
    cook = skill("cook", outcome("cooked", {"dumpling_cooked": True, "dumpling_wrapped": False}))
    wrap = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True, "dumpling_cooked": False}))
    domain = domain_of(cook, wrap, goal="dumpling_cooked and dumpling_wrapped")
    assert unreachability_reasons(domain, (False, False)) == (
        "no order of skills reaches the goal: each undoes or violates a condition that another step needs"
    )
    assert unreachability_reasons(domain, (False, False), risky=True) == (
        "every path from there may lead to a state from which the goal is out of reach"
    )


def test_parts_that_exclude_each_other_are_reported_together() -> None:
    domain = domain_of(BOIL, skill("wrap", outcome("wrapped", {"dumpling_wrapped": True})),
                       goal="dumpling_cooked and not dumpling_cooked")  # fmt: skip
    assert unreachability_reasons(domain, (False, False)) == (
        "the goal needs `dumpling_cooked and (not dumpling_cooked)`, whose parts cannot hold at the same time"
    )


def test_a_condition_that_no_skill_brings_about_is_reported_as_that() -> None:
    turned = skill("boil", outcome("cooked", {"dumpling_cooked": True}), precondition="not dumpling_cooked")
    domain = domain_of(turned, goal="not dumpling_cooked")
    assert unreachability_reasons(domain, (True,)) == (
        "the goal needs `not dumpling_cooked`, which no skill makes true"
    )


def test_an_outcome_that_never_happens_has_no_effect() -> None:
    never = Outcome("never", {"dumpling_cooked": True}, False, Fraction(0), None)
    domain = domain_of(skill("boil", outcome("cold", {"dumpling_cooked": False}), never))
    assert (
        unreachability_reasons(domain, (False,))
        == "the goal needs `dumpling_cooked`, which no skill makes true"
    )


def test_each_skill_is_asked_about_once_and_reasons_come_to_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    both = "dumpling_cooked and dumpling_wrapped"
    loop = skill("boil", outcome("cooked", {"dumpling_cooked": True}), precondition=both)
    again = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}), precondition="dumpling_cooked")
    domain = domain_of(loop, again)
    start = (False, False)
    explanation = (
        "the goal needs `dumpling_cooked`, which only `kitchen.boil` could make true; "
        "`kitchen.boil` needs `dumpling_cooked`, which only `kitchen.boil` could make true"
    )
    assert unreachability_reasons(domain, start) == explanation
    monkeypatch.setattr(unreachability, "_MAX_REASONS", 1)
    assert unreachability_reasons(domain, start) == explanation.partition(";")[0]


def test_skills_that_could_help_are_all_named() -> None:
    one, other = (
        skill(name, outcome("cooked", {"dumpling_cooked": True}), precondition="dough_on_workspace")
        for name in ("boil", "steam")
    )
    explanation = unreachability_reasons(domain_of(one, other), (False,))
    needs = "needs `dough_on_workspace`, which does not hold now, and no skill changes it"
    assert explanation == (
        "the goal needs `dumpling_cooked`, which only `kitchen.boil`, `kitchen.steam` could make true; "
        f"`kitchen.boil` {needs}; `kitchen.steam` {needs}"
    )

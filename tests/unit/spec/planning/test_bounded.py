"""The solver finds a plan with the fewest steps, or reports that it cannot decide."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.model.ecm import Outcome, TaskInvariant
from aeros.spec.planning.bounded import bounded_plan
from aeros.spec.planning.domain import domain_for
from aeros.spec.planning.search_result import AvoidSet, PlanUndecidedError
from tests.unit.agent.dumplings import SPAN, given_input, module, outcome, site, skill, term
from tests.unit.spec.planning.kitchen import BOIL, UNTOUCHED, WRAP, chain, choice_of, domain_of


def test_that_no_plan_was_found_is_not_taken_for_that_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.spec.planning.bounded.MAX_PLAN_LENGTH", 6)
    with pytest.raises(PlanUndecidedError, match="no plan of up to 6 steps was found, and none was proved"):
        bounded_plan(chain(9), (False,) * 9, AvoidSet(), 0)


READY = replace(WRAP, precondition=None)
START, WRAPPED = (False, False), (False, True)


@pytest.fixture(autouse=True)
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three steps at most, so that a plan is soon given up."""
    monkeypatch.setattr("aeros.spec.planning.bounded.MAX_PLAN_LENGTH", 3)


def planned(
    *skills: object, start: tuple[object, ...] = START, avoided: AvoidSet | None = None
) -> list[str] | None:
    domain = domain_of(*skills)  # type: ignore[arg-type]
    try:
        path = bounded_plan(domain, start, AvoidSet() if avoided is None else avoided, 0)
    except PlanUndecidedError:
        return None
    return [choice.label.removeprefix("kitchen.") for _, choice in path]


def test_a_plan_has_the_fewest_steps() -> None:
    assert planned(BOIL, READY) == ["wrap", "boil"]
    assert planned(BOIL, READY, start=WRAPPED) == ["boil"]
    assert planned(BOIL, READY, start=(True, False)) == []


def test_a_plan_is_not_looked_for_below_the_bound_that_is_known() -> None:
    idle = skill("look", outcome("seen", {"dumpling_wrapped": True}))
    path = bounded_plan(domain_of(BOIL, idle), WRAPPED, AvoidSet(), 2)
    assert len(path) == 2


def test_a_state_that_is_unknown_satisfies_nothing_until_it_is_set() -> None:
    assert planned(BOIL, READY, start=(False, None)) == ["wrap", "boil"]
    assert planned(BOIL, start=(False,)) is None
    unless = skill("boil", outcome("cooked", {"dumpling_cooked": True}), precondition="not dumpling_wrapped")
    assert planned(unless, READY, start=(False, None)) is None


def test_no_plan_counts_on_a_failure_or_on_what_never_happens() -> None:
    assert (
        planned(
            skill("boil", outcome("cold", {}), outcome("odd", {"dumpling_cooked": True}, failure=True)),
            start=(False,),
        )
        is None
    )
    never = Outcome("never", {"dumpling_cooked": True}, False, Fraction(0), None)
    assert planned(skill("boil", outcome("seen", {"dumpling_cooked": False}), never), start=(False,)) is None


def test_a_success_that_would_be_measured_as_a_failure_is_not_counted_on() -> None:
    cook = skill(
        "boil",
        outcome("cooked", {"dumpling_cooked": True}),
        outcome("burst", {"dumpling_cooked": True, "wrapper_aligned": True}, failure=True),
    )
    assert planned(cook, start=(False, False)) == ["boil"]
    assert planned(cook, start=(False, True)) is None


def test_a_success_comes_before_a_failure_with_as_many_effects() -> None:
    cook = skill(
        "boil",
        outcome("cooked", {"dumpling_cooked": True}),
        outcome("burst", {"wrapper_aligned": True}, failure=True),
    )
    assert planned(cook, start=(False, True)) == ["boil"]


def test_nothing_that_is_to_be_avoided_is_in_a_plan() -> None:
    domain = domain_of(BOIL, READY)
    choices = {name: choice_of(domain, name) for name in ("boil", "wrap")}
    for avoided in (
        AvoidSet(states={WRAPPED}),
        AvoidSet(states={(True, True)}),
        AvoidSet(pairs={(WRAPPED, choices["boil"])}),
        AvoidSet(pairs={(START, choices["wrap"])}),
    ):
        with pytest.raises(PlanUndecidedError):
            bounded_plan(domain, START, avoided, 0)
    harmless = AvoidSet(states={(True, False)}, pairs={(WRAPPED, choices["wrap"]), (START, choices["boil"])})
    assert len(bounded_plan(domain, START, harmless, 0)) == 2


def test_an_unknown_state_is_avoided_only_where_it_is_as_unknown() -> None:
    domain = domain_of(BOIL, READY)
    assert len(bounded_plan(domain, (False, None), AvoidSet(states={START}), 0)) == 2
    with pytest.raises(PlanUndecidedError):
        bounded_plan(domain, (False, None), AvoidSet(states={(False, None)}), 0)


def test_no_plan_breaks_an_invariant() -> None:
    kept = TaskInvariant("kept", term("not dumpling_wrapped"), "", SPAN)
    modules = {"kitchen": module("kitchen", (BOIL, READY))}
    domain = domain_for(modules, site(), UNTOUCHED, term("dumpling_cooked"), (kept,))
    with pytest.raises(PlanUndecidedError):
        bounded_plan(domain, START, AvoidSet(), 0)


def test_conditions_may_read_constants_and_words() -> None:
    force = {"force": given_input("force", Fraction(1, 2), (Fraction(0), Fraction(1)))}
    put = skill("put", outcome("put", {"area": "pot"}), precondition="inputs.force > 0.4", inputs=force)
    cook = skill("cook", outcome("cooked", {"dumpling_cooked": True}), precondition="area == pot")
    assert planned(put, cook, start=("table", False)) == ["put", "cook"]
    weak = skill("put", outcome("put", {"area": "pot"}), precondition="inputs.force > 0.6", inputs=force)
    assert planned(weak, cook, start=("table", False)) is None
    measured = skill("put", outcome("put", {"area": "pot"}), precondition="fill_level > 0.4")
    assert planned(measured, cook, start=("table", False)) is None  # not measured


def test_without_any_skill_only_the_start_can_be_the_goal() -> None:
    domain = domain_of(BOIL)
    empty = replace(domain, choices=())
    assert bounded_plan(empty, (True,), AvoidSet(), 0) == []
    with pytest.raises(PlanUndecidedError, match="no plan of up to 3 steps"):
        bounded_plan(empty, (False,), AvoidSet(), 0)

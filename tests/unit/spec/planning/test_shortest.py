"""The shortest plan that counts on successes, by enumeration or by the solver."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.model.ecm import Outcome, TaskInvariant
from aeros.spec.planning import shortest
from aeros.spec.planning.domain import domain_for
from aeros.spec.planning.search_result import AvoidSet, PlanPath
from aeros.spec.planning.shortest import (
    DeleteRelaxation,
    TooManyStatesError,
    breadth_first_plan,
    shortest_plan,
)
from tests.unit.agent.dumplings import SPAN, module, outcome, site, skill, term
from tests.unit.spec.planning.kitchen import BOIL, UNTOUCHED, WRAP, chain, choice_of, domain_of


def test_the_solver_takes_over_where_many_states_can_be_reached() -> None:
    domain = chain(12)
    start = (False,) * 12
    enumerated = breadth_first_plan(domain, start, AvoidSet(), 10_000)
    solved = shortest_plan(domain, start, AvoidSet(), few=5)
    assert enumerated is not None
    assert solved is not None
    assert [one.name for _, one in solved] == [one.name for _, one in enumerated]


READY = replace(WRAP, precondition=None)


def names(path: PlanPath | None) -> list[str] | None:
    return None if path is None else [one.name.removeprefix("kitchen.") for _, one in path]


def test_a_plan_is_the_steps_with_the_states_they_start_in() -> None:
    domain = domain_of(BOIL, READY)
    path = breadth_first_plan(domain, (False, False), AvoidSet(), 10)
    assert path == [((False, False), choice_of(domain, "wrap")), ((False, True), choice_of(domain, "boil"))]
    assert breadth_first_plan(domain, (True, False), AvoidSet(), 10) == []


def test_no_plan_counts_on_a_failure() -> None:
    found_early = skill("boil", outcome("cold", {}), outcome("odd", {"dumpling_cooked": True}, failure=True))
    assert breadth_first_plan(domain_of(found_early), (False,), AvoidSet(), 10) is None


def test_nothing_that_is_to_be_avoided_is_in_a_plan() -> None:
    domain = domain_of(BOIL, READY)
    start, wrapped = (False, False), (False, True)
    assert breadth_first_plan(domain, start, AvoidSet(states={wrapped}), 10) is None
    assert breadth_first_plan(domain, start, AvoidSet(states={start}), 10) is None
    assert (
        breadth_first_plan(domain, start, AvoidSet(pairs={(wrapped, choice_of(domain, "boil"))}), 10) is None
    )
    assert breadth_first_plan(domain, start, AvoidSet(pairs={(start, choice_of(domain, "boil"))}), 10)


def test_no_plan_breaks_an_invariant() -> None:
    kept = TaskInvariant("kept", term("not dumpling_wrapped"), "", SPAN)
    modules = {"kitchen": module("kitchen", (BOIL, READY))}
    domain = domain_for(modules, site(), UNTOUCHED, term("dumpling_cooked"), (kept,))
    assert breadth_first_plan(domain, (False, False), AvoidSet(), 10) is None
    assert breadth_first_plan(domain, (True, True), AvoidSet(), 10) is None


def test_of_equally_short_plans_the_most_probable_is_taken() -> None:
    def either(name: str, chance: str) -> Outcome:
        return Outcome(name, {"dumpling_cooked": True}, False, Fraction(chance), None)

    def cook(name: str, chance: str) -> object:
        return skill(name, either("cooked", chance), outcome("cold", {}, failure=True))

    for chances, best in ((("1/2", "3/4"), "steam"), (("3/4", "1/2"), "boil")):
        domain = domain_of(cook("boil", chances[0]), cook("steam", chances[1]))  # type: ignore[arg-type]
        assert names(breadth_first_plan(domain, (False,), AvoidSet(), 10)) == [best]


def test_a_search_ends_at_its_number_of_states() -> None:
    domain = chain(4)  # five states
    start = (False,) * 4
    assert breadth_first_plan(domain, start, AvoidSet(), 5) is not None
    with pytest.raises(TooManyStatesError):
        breadth_first_plan(domain, start, AvoidSet(), 4)


def test_that_there_is_no_plan_is_proved_without_enumeration() -> None:
    domain = domain_of(BOIL, WRAP)  # the dough is never there
    assert shortest_plan(domain, (False, False), AvoidSet(), few=0) is None
    assert names(shortest_plan(domain_of(BOIL, READY), (False, False), AvoidSet(), few=0)) == ["wrap", "boil"]


def test_effects_that_are_never_undone_bound_the_number_of_steps() -> None:
    relaxed = DeleteRelaxation(chain(4), (False,) * 4)
    assert relaxed.steps_to_goal == 4
    assert relaxed.values == {f"switch_{number}": {False, True} for number in range(4)}
    assert DeleteRelaxation(domain_of(BOIL, WRAP), (True, False)).steps_to_goal == 0
    hopeless = DeleteRelaxation(domain_of(BOIL, WRAP), (False, False))
    assert hopeless.steps_to_goal is None
    assert hopeless.values == {"dumpling_cooked": {False}, "dumpling_wrapped": {False}}


def test_an_outcome_that_never_happens_is_not_counted_on() -> None:
    never = Outcome("never", {"dumpling_cooked": True}, False, Fraction(0), None)
    domain = domain_of(skill("boil", outcome("seen", {"dumpling_cooked": False}), never))
    assert DeleteRelaxation(domain, (False,)).steps_to_goal is None


def test_a_condition_is_possible_if_some_values_make_it_true(monkeypatch: pytest.MonkeyPatch) -> None:
    domain = domain_of(BOIL, READY)
    relaxed = DeleteRelaxation(domain, (False, None))
    choice = choice_of(domain, "boil")

    def is_possible(text: str) -> bool:
        return relaxed.is_possible(domain.condition(term(text), choice))

    assert is_possible("dumpling_cooked and dumpling_wrapped")
    assert not is_possible("not dumpling_wrapped")  # unknown at first, and only ever set to true
    assert not is_possible("dumpling_cooked and fill_level > 0.5")
    assert not is_possible("dumpling_cooked and not dumpling_cooked")
    monkeypatch.setattr(shortest, "_MAX_VALUES", 4)
    assert not is_possible("dumpling_cooked != dumpling_cooked and dumpling_wrapped")
    monkeypatch.setattr(shortest, "_MAX_VALUES", 3)
    assert is_possible("dumpling_cooked != dumpling_cooked and dumpling_wrapped")

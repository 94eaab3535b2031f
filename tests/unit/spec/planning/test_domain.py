"""A planning domain has what bears on the goal, and nothing that the site would always deny."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

from aeros.agent.planning.strong_cyclic import explain_no_plan
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import equality_condition
from aeros.spec.expr.types import BOOL, EnumType
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, TaskInvariant
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.planning.domain import (
    MAX_COMBINATIONS,
    PartialCondition,
    domain_for,
)
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.differential.reference_cases import reference
from tests.unit.agent.dumplings import SPAN, given_input, module, outcome, site, skill, term
from tests.unit.spec.planning.kitchen import BOIL, TIDY, UNTOUCHED, WRAP, choice_of, domain_of, reason, where


def test_only_what_bears_on_the_goal_is_in_the_domain() -> None:
    domain = domain_of(BOIL, WRAP, TIDY)
    assert domain.names == ("dumpling_cooked", "dumpling_wrapped")
    assert [one.name for one in domain.choices] == ["kitchen.boil", "kitchen.wrap"]


def test_a_condition_on_measured_numbers_is_as_measured() -> None:
    fill = where(BOIL, term("fill_level > 0.5"))
    full: dict[str, Any] = {**UNTOUCHED, "fill_level": Fraction(6, 10)}
    empty: dict[str, Any] = {**UNTOUCHED, "fill_level": Fraction(4, 10)}
    domain = domain_of(fill, known=full)
    assert StrongCyclicStrategy(domain).solves(domain.state(full))
    message = reason(domain_of(fill, known=empty), empty)
    assert message.endswith("needs `0.5 < fill_level`, which does not hold now, and no skill changes it")


def test_an_input_without_default_has_each_of_few_values_and_else_keeps_the_skill_out() -> None:
    area = EnumType("area", ("table", "pot"))
    put = replace(
        skill("put", outcome("put", {"dumpling_cooked": True}), precondition="dumpling_wrapped"),
        inputs={"at": Declared(t.Variable("inputs.at", area, t.VariableRole.INPUT), SPAN)},
    )
    wanted = t.Compare("==", put.inputs["at"].variable, t.Literal("pot", area))
    put = where(put, wanted)
    domain = domain_of(put)
    strategy = StrongCyclicStrategy(domain)
    assert strategy.solves(domain.state(UNTOUCHED))
    assert strategy.chosen[domain.state(UNTOUCHED)].inputs == {"at": "pot"}
    forced = replace(
        put, inputs={"force": given_input("force", None, (Fraction(0), Fraction(1)))}, precondition=None
    )
    assert domain_of(forced).excluded_skills == {"kitchen.put": "its input `force` has no value"}
    assert "`kitchen.put` is left out: its input" in reason(domain_of(forced))


def fetching(at: Site, ecm: Ecm, start: Mapping[str, Any], goal: t.Term) -> tuple[bool, str]:
    domain = domain_for({ecm.id: ecm}, at, start, goal)
    strategy = StrongCyclicStrategy(domain)
    solved = strategy.solves(domain.state(start))
    return solved, "" if solved else explain_no_plan(strategy)


def test_no_plan_needs_what_the_site_would_always_deny() -> None:
    case = reference("fetch_object", 3)
    blind = t.Not(case.site.state["fetch_object.object_detected"].variable)
    rule = Rule("blind-grip", "", "", "", {"grip": blind}, {}, SPAN, SPAN)
    assert fetching(case.site, case.ecm, case.start, case.task.goal) == (True, "")
    forbidding = replace(case.site, rules=(*case.site.rules, rule))
    solved, why = fetching(forbidding, case.ecm, case.start, case.task.goal)
    assert not solved
    assert "deny every `grip` of `fetch_object.grasp` where `fetch_object.object_detected`" in why
    blocked = case.site.with_overrides([OperatorOverride("maintenance", "hand is worn", None, None, "grip")])
    solved, why = fetching(blocked, case.ecm, case.start, case.task.goal)
    assert not solved
    assert "`fetch_object.grasp` is left out: the operator's block `maintenance` denies" in why


def test_plans_provide_for_the_outcome_of_a_broken_hold_condition_without_relying_on_it() -> None:
    holding = replace(
        BOIL, precondition=None, hold_condition=ActionCondition(term("dumpling_wrapped"), "", SPAN)
    )
    holding = where(holding, term("dumpling_wrapped"))
    again = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}))
    domain = domain_of(holding, again)
    boil = next(one for one in domain.choices if one.name == "kitchen.boil")
    start = domain.state(UNTOUCHED | {"dumpling_wrapped": True})
    ended = {(outcome.id, then) for then, outcome, _ in domain.after(boil, start)}
    assert ("unheld", domain.state(UNTOUCHED)) in ended
    assert set(domain.settings["dumpling_wrapped"]) == {False, True}
    assert StrongCyclicStrategy(domain).solves(start)
    # Without a skill that wraps again nothing is set, so the world is taken to bring it back.
    assert StrongCyclicStrategy(domain_of(holding, known=UNTOUCHED | {"dumpling_wrapped": True})).solves(
        domain_of(holding).state(UNTOUCHED)
    )


NAMES = ("dumpling_cooked", "area")


def partial(text: str, **constants: Any) -> PartialCondition:
    return PartialCondition(term(text), NAMES, constants)


def test_a_condition_is_unknown_where_anything_in_it_is() -> None:
    condition = partial("dumpling_cooked or area == pot")
    assert [condition(state) for state in ((True, "table"), (False, "pot"), (False, "table"))] == [
        True,
        True,
        False,
    ]
    assert [condition(state) for state in ((None, "pot"), (True, None))] == [None, None]
    assert condition.evaluate_on((True, "table")) is True
    assert partial("true")((None, None)) is True


def test_a_condition_reads_constants_where_they_are_known_and_is_unknown_where_not() -> None:
    condition = partial("dumpling_cooked and fill_level > 0.5", fill_level=Fraction(1), other=1)
    assert (condition.reads, condition.constants) == (("dumpling_cooked",), {"fill_level": Fraction(1)})
    assert [condition((value, None)) for value in (True, False, None)] == [True, False, None]
    missing = partial("dumpling_cooked and fill_level > 0.5")
    assert missing.missing == ("fill_level",)
    assert missing((False, None)) is None
    # A variable of the state is never taken from the constants.
    assert partial("dumpling_cooked", dumpling_cooked=True)((False, None)) is False


def test_a_state_has_what_is_measured_and_none_for_the_rest() -> None:
    domain = domain_of(BOIL, WRAP)
    assert domain.state({"dumpling_wrapped": True, "area": "pot"}) == (None, True)
    assert domain.format_state((None, True)) == "dumpling_cooked = unknown, dumpling_wrapped = true"


def test_a_choice_is_reported_with_the_inputs_it_was_given() -> None:
    put = skill("put", outcome("put", {"dumpling_cooked": True}))
    put = replace(put, inputs={"now": Declared(t.Variable("inputs.now", BOOL, t.VariableRole.INPUT), SPAN)})
    assert [one.label for one in domain_of(put).choices] == ["kitchen.put now=false", "kitchen.put now=true"]
    assert [one.name for one in domain_of(put).choices] == ["kitchen.put"] * 2


def test_a_choice_starts_where_its_precondition_is_known_to_hold() -> None:
    domain = domain_of(BOIL, WRAP)
    boil = choice_of(domain, "boil")
    assert [domain.can_start(boil, (False, value)) for value in (True, False, None)] == [True, False, False]
    ((then, measured, share),) = domain.after(boil, (False, True))
    assert (then, measured.id, share) == ((True, True), "cooked", Fraction(1))
    assert domain.after(boil, (False, True)) is domain.after(boil, (False, True))


def test_a_condition_may_read_the_inputs_of_a_choice() -> None:
    force = {"force": given_input("force", Fraction(1, 2), (Fraction(0), Fraction(1)))}
    press = skill(
        "press", outcome("done", {"dumpling_cooked": True}), precondition="inputs.force > 0.4", inputs=force
    )
    domain = domain_of(press)
    choice = choice_of(domain, "press")
    assert domain.can_start(choice, (False,))
    assert domain.condition(term("inputs.force > 0.5"), choice)((False,)) is False


def test_only_an_invariant_that_is_known_to_fail_is_broken() -> None:
    kept = TaskInvariant("kept", term("not dumpling_cooked"), "", SPAN)
    other = TaskInvariant("other", term("dumpling_wrapped"), "", SPAN)
    modules = {"kitchen": module("kitchen", (BOIL, WRAP))}
    domain = domain_for(modules, site(), UNTOUCHED, term("dumpling_cooked"), (kept, other))
    assert [domain.violated_invariant(state) for state in ((True, False), (False, False), (False, True))] == [
        "kept",
        "other",
        None,
    ]
    assert domain.violated_invariant((None, None)) is None


def test_variables_of_invariants_and_variables_requested_by_name_are_in_the_domain() -> None:
    kept = TaskInvariant("kept", term("not filling_on_workspace"), "", SPAN)
    modules = {"kitchen": module("kitchen", (BOIL, WRAP, TIDY))}

    def names(**more: Any) -> list[str]:
        return [
            one.name
            for one in domain_for(modules, site(), UNTOUCHED, term("dumpling_cooked"), **more).choices
        ]

    assert names() == ["kitchen.boil", "kitchen.wrap"]
    assert names(invariants=(kept,)) == ["kitchen.boil", "kitchen.wrap", "kitchen.tidy"]
    assert names(extra_variables={"kitchen.tidy"}) == ["kitchen.boil", "kitchen.wrap", "kitchen.tidy"]


def test_an_outcome_that_never_happens_matters_only_where_outcomes_are_distinguished() -> None:
    never = Outcome("never", {"dumpling_cooked": True}, False, Fraction(0), None)
    assert domain_of(skill("boil", outcome("seen", {}), never)).choices == ()
    cook = skill("boil", outcome("cooked", {"dumpling_cooked": True}),
                 Outcome("never", {"wrapper_aligned": True}, True, Fraction(0), None))  # fmt: skip
    assert domain_of(cook).names == ("dumpling_cooked", "wrapper_aligned")


def test_of_very_many_inputs_only_some_are_tried() -> None:
    def wide(count: int) -> int:
        enum = EnumType("wide", tuple(f"m{number}" for number in range(count)))
        put = skill("put", outcome("put", {"dumpling_cooked": True}))
        given = Declared(t.Variable("inputs.at", enum, t.VariableRole.INPUT), SPAN)
        return len(domain_of(replace(put, inputs={"at": given})).choices)

    assert (wide(3), wide(MAX_COMBINATIONS + 1)) == (3, MAX_COMBINATIONS)


def test_the_values_that_a_variable_may_get_are_those_that_outcomes_set() -> None:
    put = skill("put", outcome("there", {"area": "pot"}), outcome("cooked", {"dumpling_cooked": True}))
    domain = domain_of(put)
    assert domain.settings == {"area": ("pot",), "dumpling_cooked": (True,)}
    assert domain.variables["area"].type == EnumType("area", ("table", "pot"))


def test_a_value_of_a_scalar_is_a_condition() -> None:
    mode = EnumType("mode", ("idle",))
    truth, word = (
        t.Variable(name, type_, t.VariableRole.STATE) for name, type_ in (("a", BOOL), ("m", mode))
    )
    assert equality_condition(truth, True) == truth
    assert equality_condition(truth, False) == t.Not(truth)
    assert equality_condition(word, "idle") == t.Compare("==", word, t.Literal("idle", mode))

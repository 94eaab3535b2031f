from __future__ import annotations

from fractions import Fraction
from math import prod

import pytest

from aeros.spec.closed_loop import definition_facts
from aeros.spec.closed_loop.definition_facts import DefinitionFacts, OutcomeValues
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import Outcome
from tests.differential.planning.number_loops import STATE, term

WRAPPED, FILL = "dumpling_wrapped", "fill_level"
VARIABLES = {name: STATE[name].variable for name in (WRAPPED, "dumpling_cooked", FILL, "count")}
TENTHS = tuple(Fraction(number, 10) for number in range(11))


def facts(text: str) -> DefinitionFacts:
    return DefinitionFacts({WRAPPED: lower(term(text))})


def outcome(effects: dict[str, bool], *either: str) -> Outcome:
    return Outcome("done", effects, False, None, None, consequences=dict.fromkeys(either))


def test_a_predicate_is_true_exactly_where_its_definition_holds() -> None:
    (one,) = facts("count >= 3").equivalences(VARIABLES)
    for wrapped in (False, True):
        for count in range(5):
            assert is_true(one, {WRAPPED: wrapped, "count": Fraction(count)}) is (wrapped is (count >= 3))


def test_a_predicate_that_may_be_either_is_computed_from_variables_that_are_known() -> None:
    found = facts("count >= 3").after(outcome({}, WRAPPED), {}, VARIABLES)
    assert found == OutcomeValues({}, {WRAPPED: lower(term("count >= 3"))}, ())


def test_a_predicate_that_may_be_either_agrees_with_open_variables() -> None:
    given = facts("fill_level > 0.5")
    found = given.after(outcome({}, WRAPPED), {FILL: TENTHS}, VARIABLES)
    assert found == OutcomeValues({FILL: TENTHS}, {}, given.equivalences(VARIABLES))


@pytest.mark.parametrize("value", [False, True])
def test_open_variables_agree_with_a_predicate_that_the_outcome_states(value: bool) -> None:
    found = facts("fill_level > 0.5").after(outcome({WRAPPED: value}), {FILL: TENTHS}, VARIABLES)
    (one,) = found.constraints
    assert [at for at in TENTHS if is_true(one, {FILL: at})] == [at for at in TENTHS if (at > 0.5) is value]


@pytest.mark.parametrize(
    ("text", "effects", "opened"),
    [
        ("fill_level > 1", {WRAPPED: True}, {FILL: TENTHS}),  # no value of it agrees
        ("fill_level > 0.5", {}, {FILL: TENTHS}),  # the predicate is as it was, which is not known here
        ("fill_level > 0.5 and count > 1", {WRAPPED: True}, {FILL: TENTHS}),  # depends on the state before
        ("count > 1", {WRAPPED: True}, {}),  # the module says both
    ],
)
def test_where_definitions_decide_none_of_the_values_there_is_no_constraint(
    text: str, effects: dict[str, bool], opened: dict[str, tuple[Fraction, ...]]
) -> None:
    assert facts(text).after(outcome(effects), opened, VARIABLES) == OutcomeValues(opened, {}, ())


@pytest.mark.parametrize("opened", [{FILL: TENTHS}, {FILL: TENTHS, "count": TENTHS[:3]}])
def test_too_many_combinations_leave_out_none(
    opened: dict[str, tuple[Fraction, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "fill_level > 0.5" if len(opened) == 1 else "fill_level > count"
    combinations = prod(map(len, opened.values()))
    for most, number in ((combinations, 1), (combinations - 1, 0)):
        monkeypatch.setattr(definition_facts, "MAX_COMBINATIONS", most)
        found = facts(text).after(outcome({WRAPPED: True}), opened, VARIABLES)
        assert len(found.constraints) == number


def test_definitions_that_no_values_meet_together_leave_out_none() -> None:
    """Each can be met alone: of both, nothing is known."""
    texts = {WRAPPED: "fill_level > 0.5", "dumpling_cooked": "fill_level < 0.5"}
    both = DefinitionFacts({name: lower(term(text)) for name, text in texts.items()})
    for stated, number in (({WRAPPED: True, "dumpling_cooked": True}, 0), ({WRAPPED: True}, 1)):
        assert len(both.after(outcome(stated), {FILL: TENTHS}, VARIABLES).constraints) == number
    apart = both.after(outcome({WRAPPED: True, "dumpling_cooked": False}), {FILL: TENTHS}, VARIABLES)
    agreeing = [at for at in TENTHS if all(is_true(one, {FILL: at}) for one in apart.constraints)]
    assert agreeing == [at for at in TENTHS if at > 0.5]


def test_variables_of_the_equivalence_are_those_of_both() -> None:
    (one,) = facts("count >= 3").equivalences(VARIABLES)
    assert t.variables_of(one).keys() == {WRAPPED, "count"}

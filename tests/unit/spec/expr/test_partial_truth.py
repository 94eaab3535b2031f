"""A condition over unknown values is true or false only where every completion agrees."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.partial_truth import partial_truth
from aeros.spec.expr.random_conditions import ConditionCase, cases, exact_environment
from aeros.spec.expr.semantics import Environment, is_true
from aeros.spec.expr.unparse import unparse
from tests.unit.spec.expr.scope import term_of

KNOWN: Environment = {"a": True, "ready": (True, False, True)}
"""`b`, `x` and everything else are unknown."""


@pytest.mark.parametrize(
    ("text", "truth"),
    [
        ("a", True),
        ("b", None),
        ("not b", None),
        ("a or b", True),
        ("b or a", True),
        ("a and b", None),
        ("not a and b", False),
        ("b and not a", False),
        ("not (a or b)", False),
        ("b implies a", True),
        ("not a implies b", True),
        ("a implies b", None),
        ("b implies not a", None),
        ("a or x <= 1 m", True),
        ("not a and x <= 1 m", False),
        ("x <= 1 m", None),
        ("all(ready[j] or a or b for j in Joint)", True),
        ("any(ready[j] for j in Joint) or b", True),
        ("any(ready[j] and b for j in Joint)", None),
        ("all(ready[j] and b for j in Joint)", False),
        # Both operands are unknown, although no value of `b` makes this false.
        ("b or not b", None),
    ],
)
def test_known_operands_decide_where_they_can(text: str, truth: bool | None) -> None:
    assert partial_truth(term_of(text), KNOWN) is truth


def test_a_condition_of_which_exactly_the_variables_are_known_is_decided() -> None:
    for value, truth in ((Fraction(1), True), (Fraction(2), False)):
        assert partial_truth(term_of("x <= 1 m"), {"x": value}) is truth
    assert partial_truth(term_of("x <= 1 m"), {"y": Fraction(1)}) is None


@pytest.mark.parametrize(
    ("condition", "then", "otherwise", "truth"),
    [
        ("a", "a", "b", True),
        ("not a", "b", "a", True),
        ("b", "a", "a", True),
        ("b", "a", "not a", None),
        ("a", "b", "a", None),
    ],
)
def test_a_choice_is_decided_by_its_condition_or_by_equal_branches(
    condition: str, then: str, otherwise: str, truth: bool | None
) -> None:
    term = t.Conditional(term_of(condition), term_of(then), term_of(otherwise))
    assert partial_truth(term, KNOWN) is truth


@given(cases(), st.data())
def test_a_truth_value_is_that_of_every_completion(case: ConditionCase, data: st.DataObject) -> None:
    complete = exact_environment(case.values)
    names = sorted(t.variables_of(case.term))
    hidden = data.draw(st.sets(st.sampled_from(names)) if names else st.just(set()))
    known = {name: value for name, value in complete.items() if name not in hidden}
    truth = partial_truth(case.term, known)
    assert truth in (None, is_true(case.term, complete)), unparse(case.term)
    if not hidden:
        assert truth is not None

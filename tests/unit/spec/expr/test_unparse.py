"""Unparsing of terms: the text parses again and means the same."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import MAX_LENGTH, ExpressionSyntaxError, parse
from aeros.spec.expr.random_conditions import ConditionCase, cases, exact_environment
from aeros.spec.expr.random_terms import JOINT, MODE, VARIABLES
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, FamilyType, RealType
from aeros.spec.expr.units import LENGTH
from aeros.spec.expr.unparse import unparse
from tests.hypothesis_profiles import examples
from tests.unit.spec.expr.scope import term_of

_LIMITS = (Fraction(1, 10), Fraction(1, 3), Fraction(-2))
SCOPE = Scope(
    VARIABLES,
    constants={"limit": t.ConstantTable("limit", FamilyType(JOINT, RealType(LENGTH)), _LIMITS)},
    enums={"Joint": JOINT, "Mode": MODE},
    past=True,
)


@examples(60)
@given(cases(), st.data())
def test_unparsed_text_means_the_same_as_its_term(case: ConditionCase, data: Any) -> None:
    text = unparse(case.term)
    if len(text) > MAX_LENGTH:
        return
    try:
        node = parse(text)
    except ExpressionSyntaxError:
        with pytest.raises(ExpressionSyntaxError, match="too deeply"):  # every operand stands in brackets
            parse(text)
        return
    env = exact_environment(case.values)
    assert evaluate(check(node, SCOPE, BOOL), env) == evaluate(case.term, env)


@pytest.mark.parametrize(
    ("text", "spelt"),
    [
        ("once within 5 s a", "once within 5 s a"),
        ("historically within 500 ms (x < 1 m)", "not (once within 0.5 s (not (x < 1 m)))"),
        ("x - y < 1 m", "(x - y) < 1 m"),
        ("not a since b", "(not a) since b"),
        ("not (a since within 1 s b)", "not (a since within 1 s b)"),
        (
            "count within 60 s (a and not previously a) <= 3",
            "(count within 60 s (a and (not (previously a)))) <= 3",
        ),
        ("x <= 1 m / 3", "x <= (1 m / 3)"),
        ("x <= -2 m", "x <= (-2 m)"),
    ],
)
def test_unparsed_text_is_as_a_person_would_write_it(text: str, spelt: str) -> None:
    term = check(parse(text), SCOPE, BOOL)
    assert unparse(term) == spelt
    assert check(parse(spelt), SCOPE, BOOL) == term


def test_inputs_and_distances_are_unparsed_too() -> None:
    term = term_of("inputs.pace <= 2 mm/s and distance(p, home) <= reach")
    assert unparse(term).startswith("(inputs.pace <= 0.002 m/s) and (")

"""Terms that are whole by their structure."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import JOINT, VARIABLES
from aeros.spec.expr.typecheck.check import infer
from aeros.spec.expr.typecheck.integrality import is_integral
from aeros.spec.expr.types import FamilyType, IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from tests.unit.spec.expr.scope import SCOPE

WHOLE, REAL = VARIABLES["laps"], VARIABLES["n"]
ONE, HALF = (t.Literal(Fraction(value), RealType(NUMBER)) for value in ("1", "1/2"))
INDEX = t.BoundVariable("i", JOINT)
COUNTS = t.Variable("counts", FamilyType(JOINT, IntegerType()), t.VariableRole.STATE)
TRUE = t.TRUE

INTEGRAL: list[t.Term] = [
    ONE,
    WHOLE,
    t.Select(COUNTS, INDEX),
    t.Occurrences(TRUE, Fraction(1)),
    t.Aggregate("count", INDEX, TRUE),
    t.Aggregate("sum", INDEX, t.Select(COUNTS, INDEX)),
    t.Absolute(WHOLE),
    t.Add(WHOLE, ONE),
    t.Multiply(WHOLE, WHOLE),
    t.Extremum("min", WHOLE, ONE),
    t.Conditional(t.Compare("<", REAL, HALF), WHOLE, ONE),
]
OTHERS: list[t.Term] = [
    HALF,
    REAL,
    t.Select(VARIABLES["joint"], INDEX),
    t.Select(t.ConstantTable("counts", FamilyType(JOINT, IntegerType()), (Fraction(1),) * 3), INDEX),
    t.Aggregate("sum", INDEX, REAL),
    t.Absolute(REAL),
    t.Component(VARIABLES["p"], 0),
    *(make(*pair) for pair in ((WHOLE, HALF), (REAL, WHOLE)) for make in (t.Add, t.Multiply)),
    t.Extremum("max", WHOLE, REAL),
    t.Extremum("max", REAL, WHOLE),
    t.Conditional(TRUE, WHOLE, REAL),
    t.Conditional(TRUE, REAL, WHOLE),
]


@pytest.mark.parametrize("term", INTEGRAL, ids=lambda term: type(term).__name__)
def test_a_term_that_is_whole_by_its_structure_is_recognised(term: t.Term) -> None:
    assert is_integral(term)


@pytest.mark.parametrize("term", OTHERS, ids=lambda term: type(term).__name__)
def test_any_other_term_is_not(term: t.Term) -> None:
    assert not is_integral(term)


@pytest.mark.parametrize(
    ("text", "whole"),
    [
        ("3", True),
        ("1.5", False),
        ("laps * 2 - 7", True),
        ("laps / 2", False),
        ("count(ready[j] for j in Joint)", True),
        ("sum((if ready[j] then 1 else laps) for j in Joint)", True),
        ("sum((if ready[j] then 0.5 else laps) for j in Joint)", False),
        ("max(abs(laps), 3)", True),
        ("n", False),
        ("n - n", False),
    ],
)
def test_a_term_is_whole_if_its_parts_are(text: str, whole: bool) -> None:
    term, _ = infer(parse(text), SCOPE)
    assert is_integral(term) is whole

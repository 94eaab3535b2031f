"""The numbers of a condition's text are read, and replaced by others."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import LENGTH, NUMBER, Unit
from aeros.spec.model.variables import Declared
from aeros.spec.verification.repairs.condition_text import (
    add_bound,
    branches_of,
    comparisons_in,
    conjoin_texts,
    count_decimals,
    read_number,
    replace_number,
    unit_used_for,
)

MM, BARE = Unit("mm", Fraction(1, 1000), LENGTH), Unit("1", Fraction(1), NUMBER)
SPAN = Source("x", "x").span(0, 1)


def compared(text: str) -> list[tuple[str, str, str]]:
    return [
        (text[left.extent.start : left.extent.end], op, text[right.extent.start : right.extent.end])
        for left, right, op in comparisons_in(parse(text))
    ]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a < 1", [("a", "<", "1")]),
        ("1 m <= a < b", [("1 m", "<=", "a"), ("a", "<", "b")]),
        ("a < 1 and b and (c >= 2 and d == e)", [("a", "<", "1"), ("c", ">=", "2"), ("d", "==", "e")]),
        ("a < 1 or b < 2", []),
        ("not a < 1", []),
        ("a", []),
    ],
)
def test_the_comparisons_make_a_condition_stricter(text: str, found: list[tuple[str, str, str]]) -> None:
    assert compared(text) == found


def test_a_number_is_read_in_its_own_unit_with_or_without_a_minus() -> None:
    for text, value, unit in (
        ("250 mm", 250, "mm"),
        ("-1.5 m", Fraction(-3, 2), "m"),
        ("7", 7, "1"),
        ("- 20 %", -20, "%"),
    ):
        found = read_number(parse(text))
        assert found is not None
        assert (found[0], found[1].text) == (value, unit)
    for text in ("a", "-a", "1 + 1", "not a", "-(1 + a)"):
        assert read_number(parse(text)) is None


@pytest.mark.parametrize(
    ("numeral", "digits"), [("1", 0), ("1.", 0), ("1.50 m", 2), ("-0.125", 3), ("1.5e-3", 1), ("", 0)]
)
def test_the_digits_after_the_point_are_counted(numeral: str, digits: int) -> None:
    assert count_decimals(numeral) == digits


def replaced(text: str, value: str, excluded: bool, at: int = 0) -> str:
    left, right, op = list(comparisons_in(parse(text)))[at]
    literal = right if read_number(right) is not None else left
    edited = replace_number(text, literal.extent, (left.extent.end, right.extent.start), op)(value, excluded)
    assert edited is not None
    return edited


def test_a_number_among_several_is_not_excluded_by_itself() -> None:
    text = "a <= (if b then 1 m else if c then 2 m else 3 m)"
    ((_, right, op),) = comparisons_in(parse(text))
    first, second, third = branches_of(right)
    edit = replace_number(text, second.extent, None, op)
    assert edit("4", False) == "a <= (if b then 1 m else if c then 4 m else 3 m)"
    assert edit("4", True) is None
    assert [read_number(one) is not None for one in (first, third)] == [True, True]
    assert list(branches_of(first)) == [first]


@pytest.mark.parametrize(
    ("text", "value", "excluded", "edited"),
    [
        ("speed <= 250 mm/s", "100", False, "speed <= 100 mm/s"),
        ("speed <= 250 mm/s", "100", True, "speed < 100 mm/s"),
        ("speed < 250 mm/s", "0.5", True, "speed < 0.5 mm/s"),
        ("250mm/s>=speed and a", "7", True, "7mm/s>speed and a"),
        ("-1.5e-2 m < x", "-2", False, "-2 m < x"),
        ("x >= - 3 m", "4", False, "x >= 4 m"),
    ],
)
def test_a_number_is_replaced_and_all_else_stays(text: str, value: str, excluded: bool, edited: str) -> None:
    assert replaced(text, value, excluded) == edited


def test_in_a_chain_the_one_bound_is_replaced() -> None:
    assert replaced("1 m <= x <= 3 m", "2", True) == "2 m < x <= 3 m"
    assert replaced("1 m <= x <= 3 m", "2", True, at=1) == "1 m <= x < 2 m"


@pytest.mark.parametrize(
    ("upper", "excluded", "op"),
    [(True, False, "<="), (True, True, "<"), (False, False, ">="), (False, True, ">")],
)
def test_a_bound_is_added_with_its_operator(upper: bool, excluded: bool, op: str) -> None:
    assert add_bound("a", "x", upper, MM)("250", excluded) == f"a and x {op} 250 mm"


def test_a_bare_number_is_added_without_a_unit_and_to_true_alone() -> None:
    assert add_bound("true", "n", True, BARE)("3", False) == "n <= 3"
    percent = Unit("%", Fraction(1, 100), NUMBER)
    assert add_bound("true", "n", True, percent)("3", False) == "n <= 3 %"


@pytest.mark.parametrize(
    ("text", "condition", "joined"),
    [
        ("a", "b", "a and b"),
        (" a and b ", "c", "a and b and c"),
        ("a or b", "c", "(a or b) and c"),
        ("a", "b implies c", "a and (b implies c)"),
        ("if a then b else c", "d", "(if a then b else c) and d"),
        ("(a or b)", " (c) ", "(a or b) and (c)"),
        ("(a) or (b)", "c", "((a) or (b)) and c"),
        ("not a", "b < c", "not a and b < c"),
        ("true", "a or b", "a or b"),
        ("a", " true ", "a"),
        ("true", "true", ""),
    ],
)
def test_two_conditions_are_joined_with_brackets_where_they_are_needed(
    text: str, condition: str, joined: str
) -> None:
    assert conjoin_texts(text, condition) == joined


def test_the_unit_is_that_of_the_first_number_of_its_dimension() -> None:
    length = Declared(t.Variable("x", RealType(LENGTH), t.VariableRole.STATE), SPAN, unit=MM)
    assert unit_used_for(length, "a < 3 s", "b < 2 cm and c < 1 m").text == "cm"
    assert unit_used_for(length, "c < 1 m", "b < 2 cm").text == "m"
    assert unit_used_for(length, "max(a, 2 s) < 3 s", "n < 4") is MM
    assert unit_used_for(length) is MM

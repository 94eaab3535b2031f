"""Generated functions accept the same values as `ValueChecker.unpack`, and return the same scalars."""

from __future__ import annotations

from fractions import Fraction
from math import inf, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.gate.compiled.codegen import FunctionWriter
from aeros.runtime.gate.value_check import ValueChecker
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.variables import Declared
from tests.unit.runtime.conftest import METRES, SIDES, declare

RANGE = (Fraction(-1, 10), Fraction(2))
DECLARED: dict[str, Declared] = {
    "truth": declare("x", BOOL, t.VariableRole.STATE),
    "member": declare("x", SIDES, t.VariableRole.STATE),
    "number": declare("x", METRES, t.VariableRole.STATE, range=RANGE),
    "whole": declare("x", IntegerType(NUMBER), t.VariableRole.STATE, range=(Fraction(-1), Fraction(3))),
    "vector": declare("x", VectorType(LENGTH), t.VariableRole.STATE, range=RANGE),
    "family": declare(
        "x", FamilyType(EnumType("joints", ("j1", "j2")), METRES), t.VariableRole.STATE, range=RANGE
    ),
}

_SCALARS = (
    st.booleans()
    | st.sampled_from(["left", "right", "up", "", -0.1, 2.0, 2, 3, 2**60, nan, inf, -inf, None])
    | st.floats(-0.2, 2.1)
    | st.integers(-2, 4)
)
VALUES = _SCALARS | st.lists(_SCALARS, max_size=4) | st.lists(_SCALARS, max_size=4).map(tuple)


def in_words(form: ValueChecker, value: Any) -> dict[str, Any] | None:
    """Return the scalars that `ValueChecker` itself unpacks, None if it objects."""
    scalars: dict[str, Any] = {}
    return scalars if form.unpack(value, scalars) is None else None


@pytest.mark.parametrize("name", DECLARED)
@given(value=VALUES)
def test_a_generated_function_accepts_the_same_values_as_its_checker(name: str, value: Any) -> None:
    form = ValueChecker(DECLARED[name])
    assert repr(FunctionWriter().build_unpacker(form)(value)) == repr(in_words(form, value))


@pytest.mark.parametrize(
    ("name", "accepted", "refused"),
    [
        ("truth", [True, False], [1, 0.0, "True", None]),
        ("member", ["left", "right"], ["up", True, None, 0]),
        # -0.1 as a double is below -1/10.
        ("number", [-0.09999999999999999, 2, 2.0], [-0.1, 2.0000000000000004, nan, inf, True, "1", None]),
        ("whole", [-1, 0.0, 3.0, 3], [0.5, 4, -2.0, False, nan]),
        ("vector", [(0.0, 1.0, 2.0), [0, 1, 2]], [(0.0, 1.0), (0.0, 1.0, 3.0), (0.0, 1.0, None), 1.0, "abc"]),
        ("family", [(0.0, 2.0), [1, 1]], [(0.0,), (0.0, 2.5), {0: 1.0, 1: 1.0}]),
    ],
)
def test_values_at_the_edges(name: str, accepted: list[Any], refused: list[Any]) -> None:
    form = ValueChecker(DECLARED[name])
    taking = FunctionWriter().build_unpacker(form)
    assert [value for value in accepted if taking(value) is None] == []
    assert [value for value in refused if taking(value) is not None] == []
    assert [value for value in accepted if taking(value) != in_words(form, value)] == []


def test_an_implied_range_is_not_checked_but_the_type_is() -> None:
    writer = FunctionWriter()
    writer.implied = frozenset({"x"})
    taking = writer.build_unpacker(ValueChecker(DECLARED["number"]))
    assert taking(100.0) == {"x": 100.0}
    assert taking(100) == {"x": 100.0}


def test_a_failed_check_leaves_by_the_given_exit_statement() -> None:
    writer = FunctionWriter()
    writer.exit_statement = "return 'left'"
    writer.write_guard("value > 1")
    start = len(writer.lines)
    writer.add_line("return 'stayed'")
    writer.lines.insert(start, "  if True:")
    writer.indent(start + 1)
    function = writer.compile_function("check", ["def check(value):", *writer.lines])
    assert (function(1), function(2)) == ("left", "stayed")


def test_generated_code_reaches_no_builtins() -> None:
    writer = FunctionWriter()
    with pytest.raises(NameError, match="open"):
        writer.compile_function("check", ["def check():", "  return open"])()

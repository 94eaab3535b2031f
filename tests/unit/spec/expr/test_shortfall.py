"""A condition that does not hold is explained by the bounds that are not met."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds
from tests.unit.spec.expr.scope import term_of

AT: dict[str, Any] = {
    "a": True,
    "b": False,
    "mode": "move",
    "x": 0.5,
    "y": -2.0,
    "n": 3.0,
    "speed": 0.25,
    "k": 2.0,
    "joint[j1]": 1.0,
    "joint[j2]": 5.0,
    "joint[j3]": 3.0,
    "ready[j1]": True,
    "ready[j2]": False,
    "ready[j3]": True,
    "inputs.pace": 1.0,
}


def lines_of(text: str) -> list[str]:
    return [str(one) for one in unmet_bounds(term_of(text), AT)]


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("x <= 20 cm", ["x is 0.5 m (at most 0.2 m)"]),
        ("x < 0.5 m", ["x is 0.5 m (below 0.5 m)"]),
        ("x >= 1 m", ["x is 0.5 m (at least 1 m)"]),
        ("x > 1 m", ["x is 0.5 m (above 1 m)"]),
        ("x == 1 m", ["x is 0.5 m (exactly 1 m)"]),
        ("1 m == x", ["x is 0.5 m (exactly 1 m)"]),
        ("x != 0.5 m", ["x is 0.5 m (other than 0.5 m)"]),
        ("0.5 m != x", ["x is 0.5 m (other than 0.5 m)"]),
        ("not x <= 1 m", ["x is 0.5 m (above 1 m)"]),
        ("not x < 1 m", ["x is 0.5 m (at least 1 m)"]),
        ("not x >= 20 cm", ["x is 0.5 m (below 0.2 m)"]),
        ("not x > 20 cm", ["x is 0.5 m (at most 0.2 m)"]),
        ("not a", ["a is true"]),
        ("b", ["b is false"]),
        ("mode == idle", ["mode is move (exactly idle)"]),
        ("mode != move", ["mode is move (other than move)"]),
        ("n < 3", ["n is 3 (below 3)"]),
        ("abs(y) <= 1 m", ["abs(y) is 2 m (at most 1 m)"]),
        ("x >= y + 3 m", ["x is 0.5 m (at least 1 m)"]),
        ("x + 3 m <= y", ["y is -2 m (at least 3.5 m)"]),
        ("x < y", ["x is 0.5 m (below -2 m)"]),
        ("x * x >= 1 m^2", ["`x * x` is 0.25 m^2 (at least 1 m^2)"]),
        ("false", ["never allowed"]),
    ],
)  # fmt: skip
def test_an_unmet_bound_says_value_and_bound(text: str, lines: list[str]) -> None:
    assert lines_of(text) == lines


def test_a_condition_that_holds_has_nothing_unmet() -> None:
    assert lines_of("a and x <= 1 m and mode == move") == []


def test_of_a_conjunction_the_parts_that_fail_are_reported_each_once() -> None:
    assert lines_of("x <= 1 m and b and x > 1 m and b") == ["b is false", "x is 0.5 m (above 1 m)"]


def test_of_a_disjunction_every_part_is_reported_and_of_an_implication_both_sides() -> None:
    assert lines_of("b or x > 1 m") == ["b is false", "x is 0.5 m (above 1 m)"]
    assert lines_of("a implies b") == ["a is true", "b is false"]


def test_a_measured_quantity_is_reported_before_a_requested_one_and_that_before_a_constant() -> None:
    # `k` is measured, `speed` is a parameter and `inputs.pace` an input: of these, the left is reported.
    assert lines_of("speed <= k * 0.1 m/s") == ["`k * 0.1 m/s` is 0.2 m/s (at least 0.25 m/s)"]
    assert lines_of("k * 0.1 m/s >= speed") == ["`k * 0.1 m/s` is 0.2 m/s (at least 0.25 m/s)"]
    assert lines_of("speed <= inputs.pace * 0.1") == ["speed is 0.25 m/s (at most 0.1 m/s)"]
    assert (
        lines_of("speed <= 0.1 m/s")
        == lines_of("0.1 m/s >= speed")
        == ["speed is 0.25 m/s (at most 0.1 m/s)"]
    )


def test_a_constant_added_to_the_measured_quantity_is_moved_to_the_bound() -> None:
    assert lines_of("x + 1 m <= 1.2 m") == ["x is 0.5 m (at most 0.2 m)"]
    assert lines_of("1.2 m >= x + 1 m - 25 cm") == ["x is 0.5 m (at most 0.45 m)"]


def test_each_member_of_a_family_is_reported_by_itself() -> None:
    assert lines_of("all(ready[i] for i in Joint)") == ["ready[j2] is false"]
    assert lines_of("all(joint[i] <= 2 m for i in Joint)") == [
        "joint[j2] is 5 m (at most 2 m)",
        "joint[j3] is 3 m (at most 2 m)",
    ]


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (1.0, ("1 m", "2 m")),
        (2.0001, ("2.0001 m", "2 m")),
        (2.0000001, ("2.0000001 m", "2 m")),
        (2.0000000000000004, ("2.0000000000000004 m", "2 m")),
        (2.0, ("2 m", "2 m")),
        (1234.5678, ("1235 m", "2 m")),
    ],
)
def test_numbers_have_as_many_digits_as_it_takes_to_differ(value: float, shown: tuple[str, str]) -> None:
    assert UnmetBound("x", value, "at most", 2.0, "m").formatted_values() == shown


def test_a_value_that_is_not_known_says_why() -> None:
    bound = UnmetBound("x", None, "at most", 2.0, "m", reason="was not measured for 3 s")
    assert str(bound) == "`x` was not measured for 3 s"
    assert bound.formatted_values() == ("unknown", "2 m")


_TEXTS = ("x <= 20 cm", "not a", "b", "mode == idle", "a and b", "a or b", "x < y", "a implies b", "n == 3")


@given(parts=st.lists(st.sampled_from(_TEXTS), min_size=1, max_size=3), x=st.floats(-1, 1), a=st.booleans())
def test_something_is_unmet_exactly_where_the_condition_does_not_hold(
    parts: list[str], x: float, a: bool
) -> None:
    term = t.conjunction(*map(term_of, parts))
    at = {**AT, "x": x, "a": a}
    exact = {name: Fraction(value) if isinstance(value, float) else value for name, value in at.items()}
    assert bool(unmet_bounds(term, at)) is not is_true(term, exact)

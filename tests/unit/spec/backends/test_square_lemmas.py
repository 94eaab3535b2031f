from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import pytest

from aeros.spec.backends.square_lemmas import MAX_FACTORS, square_lemmas
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL


def squares(text: str, near: Mapping[str, float] | None = None) -> list[t.Compare]:
    lowered = lower(check(parse(text), Scope(VARIABLES), BOOL))
    lemmas = list(square_lemmas(list(t.walk([lowered])), near or {}))
    compared = [one for one in lemmas if isinstance(one, t.Compare)]
    assert len(compared) == len(lemmas)
    return compared


def roots_at(lemmas: list[t.Compare], point: Mapping[str, Fraction]) -> list[Fraction]:
    """Compute the squared numbers at a point."""
    found = []
    for lemma in lemmas:
        assert isinstance(lemma.right, t.Multiply)
        root = evaluate(lemma.right.left, point)
        assert isinstance(root, Fraction)
        found.append(root)
    return found


def test_the_factors_of_a_product_are_added_and_subtracted() -> None:
    point = {"x": Fraction(3), "y": Fraction(-2)}
    assert sorted(map(abs, roots_at(squares("x * y <= 4 m*m"), point))) == [1, 5]


@pytest.mark.parametrize("text", ["x <= y", "abs(x) + abs(y) <= 2 m", "2 * x <= 4 m"])
def test_a_question_without_products_stays_linear(text: str) -> None:
    assert squares(text, {"x": 1.0, "y": 1.0}) == []


def test_factors_without_a_common_product_are_not_paired() -> None:
    assert squares("x * x <= 4 m*m and y * y <= 9 m*m") == []
    # The same with a product of both.
    assert squares("x * x <= 4 m*m and (x + y) * y <= 9 m*m") != []


def test_an_absolute_value_is_paired_with_what_it_shares_a_variable_with() -> None:
    point = {"x": Fraction(7), "y": Fraction(3)}
    roots = roots_at(squares("abs(x - y) <= 1 m and x * x <= 4 m*m and y * y <= 4 m*m"), point)
    assert {abs(one) for one in roots} >= {11, 3}  # (x - y) + x and (x - y) - x


def test_three_factors_whose_products_all_occur_are_added() -> None:
    point = {"x": Fraction(1), "y": Fraction(10), "p.x": Fraction(100)}
    roots = roots_at(squares("x * y + y * p.x + x * p.x <= 1 m*m"), point)
    assert {111, 91, 89, 109} <= {abs(one) for one in roots}


def test_squares_from_a_point_vanish_there() -> None:
    text = "x * y <= 4 m*m"
    point = {"x": Fraction(3, 2), "y": Fraction(-1, 4)}
    nearby = {name: float(value) + 1e-9 for name, value in point.items()}
    fresh = roots_at(squares(text, nearby), point)[len(squares(text)) :]
    assert fresh.count(Fraction(0)) == 3  # r * x - y, x - c and y - c
    assert all(abs(one) < Fraction(1, 50) for one in fresh)


def test_a_point_where_a_factor_is_0_gives_no_ratio() -> None:
    assert all(
        one < 10
        for one in roots_at(
            squares("x * y <= 4 m*m", {"x": 0.0, "y": 1.0}), {"x": Fraction(1), "y": Fraction(1)}
        )
    )


def test_a_question_with_many_factors_has_none() -> None:
    many = " + ".join(f"(x + {number} m) * (x + {number} m)" for number in range(MAX_FACTORS + 1))
    assert squares(f"{many} <= 4 m*m") == []

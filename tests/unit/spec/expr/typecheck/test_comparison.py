"""Comparisons and membership: the few nodes that they become."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.random_terms import MODE as MODES
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import LENGTH
from tests.unit.spec.expr.scope import SCOPE, term_of

X, Y, MODE = (SCOPE.variables[name] for name in ("x", "y", "mode"))


@pytest.mark.parametrize(
    ("text", "term"),
    [
        ("x <= y", t.Compare("<=", X, Y)),
        ("x > y", t.Compare("<", Y, X)),
        ("x >= y", t.Compare("<=", Y, X)),
        ("x != y", t.Not(t.Compare("==", X, Y))),
        ("x < y < x", t.And((t.Compare("<", X, Y), t.Compare("<", Y, X)))),
    ],
)
def test_every_comparison_becomes_one_of_three(text: str, term: t.Term) -> None:
    assert term_of(text) == term


def test_membership_in_a_set_is_equality_with_a_member() -> None:
    idle, stop = (t.Compare("==", MODE, t.Literal(member, MODES)) for member in ("idle", "stop"))
    assert term_of("mode in {idle, stop}") == t.Or((idle, stop))
    assert term_of("mode not in {idle}") == t.Not(t.Or((idle,)))


def test_membership_in_a_volume_bounds_each_coordinate_on_both_sides() -> None:
    term = term_of("p in cell")
    assert isinstance(term, t.And)
    coordinates = [t.Component(SCOPE.variables["p"], axis) for axis in range(3)]
    sides = [(part.left, part.right) for part in term.operands if isinstance(part, t.Compare)]
    assert [right for _, right in sides[::2]] == [left for left, _ in sides[1::2]] == coordinates
    corners = [t.Literal(Fraction(bound), RealType(LENGTH)) for bound in (-1, 1)]
    assert [[left for left, _ in sides[::2]], [right for _, right in sides[1::2]]] == [
        [corner] * 3 for corner in corners
    ]

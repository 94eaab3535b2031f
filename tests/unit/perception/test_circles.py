"""Circles through points."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.perception.circles import fit_circle


@given(
    st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    st.floats(0.01, 1.0),
    st.floats(0.5, 2.0 * pi),
)
def test_a_circle_is_found_from_an_arc_of_it(middle: tuple[float, float], radius: float, arc: float) -> None:
    angles = np.linspace(0.0, arc, 40)
    edge = np.column_stack((middle[0] + radius * np.cos(angles), middle[1] + radius * np.sin(angles)))
    found = fit_circle(edge)
    assert found is not None
    assert found == pytest.approx((*middle, radius, 0.0), abs=1e-6)


def test_the_spread_tells_a_square_from_a_circle() -> None:
    way = np.linspace(-1.0, 1.0, 20)
    sides = [np.column_stack((way, np.full(20, side))) for side in (-1.0, 1.0)]
    square = np.concatenate((*sides, *(side[:, ::-1] for side in sides)))
    found = fit_circle(square)
    assert found is not None
    assert found.spread > 0.1


@pytest.mark.parametrize("edge", [[], [(0, 0)], [(0, 0), (1, 1)], [(0, 0), (1, 1), (2, 2)], [(1, 2)] * 4])
def test_points_in_a_line_are_on_no_circle(edge: list[tuple[float, float]]) -> None:
    assert fit_circle(np.array(edge, np.float64).reshape(-1, 2)) is None

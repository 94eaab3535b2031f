"""Cylinders of known size from the points on their upper sides."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.perception.cylinders import locate_cylinder
from aeros.perception.rectangles import wrap_heading

RADIUS, HEIGHT = 0.03, 0.12


def test_a_standing_cylinder_has_a_disc_on_top() -> None:
    u, v = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-RADIUS, RADIUS, 21)]))
    disc = np.hypot(u, v) <= RADIUS
    points = np.column_stack((0.5 + u[disc], 0.1 + v[disc], np.full(disc.sum(), HEIGHT)))
    side = np.array([[0.47, 0.1, 0.05], [0.47, 0.11, 0.06]])
    found = locate_cylinder(np.concatenate((points, side)), RADIUS, HEIGHT)
    assert found.position == pytest.approx((0.5, 0.1, HEIGHT / 2.0), abs=1e-9)
    assert (found.axis, found.heading, found.top) == (None, None, HEIGHT)


@given(st.floats(-pi, pi))
def test_a_lying_cylinder_has_a_strip_on_top(heading: float) -> None:
    along, around = (
        part.ravel()
        for part in np.meshgrid(np.linspace(-HEIGHT / 2, HEIGHT / 2, 25), np.linspace(-0.4, 0.4, 9))
    )
    across, up = RADIUS * np.sin(around), RADIUS * (1.0 + np.cos(around))
    points = np.column_stack(
        (
            0.5 + along * cos(heading) - across * sin(heading),
            0.1 + along * sin(heading) + across * cos(heading),
            up,
        )
    )
    found = locate_cylinder(points, RADIUS, HEIGHT)
    assert found.position == pytest.approx((0.5, 0.1, RADIUS), abs=0.002)
    assert found.axis is not None
    assert -pi / 2 <= found.axis < pi / 2
    assert wrap_heading(found.axis - heading, pi) == pytest.approx(0.0, abs=1e-6)

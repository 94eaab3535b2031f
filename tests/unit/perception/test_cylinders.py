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


@pytest.mark.parametrize("sigma", [0.0, 0.002, 0.003, 0.005])
@pytest.mark.parametrize("lies", [False, True])
def test_noise_of_depth_does_not_raise_a_lying_cylinder_or_tip_a_standing_one(
    lies: bool, sigma: float
) -> None:
    """The can of the fetching scene, some 500 pixels of it: noise moves heights, and its ends hardly."""
    radius, height = 0.022, 0.08
    random = np.random.default_rng(7)
    for _ in range(20):
        if lies:
            along, around = random.uniform(-height / 2, height / 2, 500), random.uniform(-1.2, 1.2, 500)
            points = np.column_stack((along, radius * np.sin(around), radius * (1.0 + np.cos(around))))
        else:
            away, turn = radius * np.sqrt(random.uniform(0, 1, 200)), random.uniform(-pi, pi, 500)
            top = np.column_stack(
                (away * np.cos(turn[:200]), away * np.sin(turn[:200]), np.full(200, height))
            )
            side = -np.abs(turn[200:]) / 2.0
            below = random.uniform(0.0, height, 300)
            points = np.concatenate(
                (top, np.column_stack((radius * np.cos(side), radius * np.sin(side), below)))
            )
        points[:, 2] += sigma * random.standard_normal(len(points))
        found = locate_cylinder(points, radius, height)
        assert (found.axis is not None) is lies
        assert found.position[2] == pytest.approx(radius if lies else height / 2.0, abs=0.002 + sigma)
        assert found.top == pytest.approx(2.0 * radius if lies else height, abs=0.001 + 2.5 * sigma)
        if lies:
            assert found.axis == pytest.approx(0.0, abs=0.1 + 20.0 * sigma)


@pytest.mark.parametrize("heading", [0.0, 0.4, -1.2])
def test_a_flat_cylinder_stands_as_a_disc_and_lies_as_a_strip_across_its_axis(heading: float) -> None:
    radius, height = 0.03, 0.025
    u, v = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-radius, radius, 21)]))
    disc = np.hypot(u, v) <= radius
    standing = np.column_stack((0.5 + u[disc], 0.1 + v[disc], np.full(disc.sum(), height)))
    assert locate_cylinder(standing, radius, height).heading is None
    along, angle = (
        part.ravel()
        for part in np.meshgrid(np.linspace(-height / 2, height / 2, 9), np.linspace(0.0, pi, 41))
    )
    across, up = radius * np.cos(angle), radius * (1.0 + np.sin(angle))
    c, s = cos(heading), sin(heading)
    lying = np.column_stack((0.5 + c * along - s * across, 0.1 + s * along + c * across, up))
    found = locate_cylinder(lying, radius, height)
    assert found.axis is not None
    assert abs(wrap_heading(found.axis - heading, pi)) < 0.1

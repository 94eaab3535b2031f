"""Sections of solids, and rays that enter them, by their definitions."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.pictures.ray_caster import place
from aeros.sim.pictures.solids import box, cylinder, hull, sphere
from aeros.sim.scanners.ray_fan import ray_fan
from aeros.sim.scanners.sections import Disc, Polygon, Section, cast, cut, rectangle
from tests.unit.sim.scanners.cells import inside, scanners_at

GREY = (0.5, 0.5, 0.5)
PLACES = st.floats(-3.0, 3.0)
SIZES = st.floats(0.05, 1.0)
ONE = scanners_at((0.0, 0.0, 0.0))
FAN = ray_fan(ONE)
FREE = np.full(len(FAN.origins), ONE.range)

SECTIONS = st.one_of(
    st.builds(Disc, PLACES, PLACES, SIZES),
    st.builds(lambda x, y, a, b: rectangle((x, y), (x + a, y + b)), PLACES, PLACES, SIZES, SIZES),
)


@given(st.lists(SECTIONS, max_size=3))
def test_a_ray_ends_where_it_first_enters_something(sections: list[Section]) -> None:
    if any(inside(one, np.zeros((1, 2)), 1e-3)[0] for one in sections):
        return  # of a scanner inside something nothing is claimed
    ranges = cast(FAN, FREE, sections)
    before = FAN.directions * np.maximum(ranges - 1e-6, 0.0)[:, None]
    behind = FAN.directions * (ranges + 1e-6)[:, None]
    for one in sections:
        for share in (0.25, 0.5, 0.75, 0.9, 1.0):
            assert not inside(one, before * share, -1e-7).any()
    is_hit = ranges < ONE.range
    entered = np.zeros(len(ranges), dtype=bool)
    for one in sections:
        entered |= inside(one, behind, 1e-5)
    assert entered[is_hit].all()


def test_a_ray_that_passes_a_box_is_not_shortened() -> None:
    assert (cast(FAN, FREE, [rectangle((-2.0, 5.6), (2.0, 6.0))]) == FREE).all()


@pytest.mark.parametrize(
    ("height", "radius"), [(0.0, 0.5), (0.3, 0.4), (-0.4, 0.3), (0.5, None), (0.6, None)]
)
def test_a_cut_sphere_is_a_disc(height: float, radius: float | None) -> None:
    section = cut(place(sphere(0.5, GREY), Pose((1.0, 2.0, 1.0), (0.0, 0.0, 0.0, 1.0))), 1.0 + height)
    if radius is None:
        assert section is None
    else:
        assert section == pytest.approx((1.0, 2.0, radius))


@pytest.mark.parametrize("height", [-0.31, -0.3, 0.0, 0.29, 0.3, 0.31])
def test_a_cut_box_is_its_turned_rectangle_between_its_faces(height: float) -> None:
    yaw = 0.4
    section = cut(
        place(box((0.8, 0.4, 0.6), GREY), Pose((1.0, 2.0, 0.5), yaw_orientation(yaw))), 0.5 + height
    )
    if abs(height) >= 0.3:
        assert section is None
        return
    assert isinstance(section, Polygon)
    local = np.array([(0.39, 0.19), (0.41, 0.19), (0.39, 0.21), (-0.39, -0.19), (-0.41, 0.0)])
    turn = np.array(((cos(yaw), -sin(yaw)), (sin(yaw), cos(yaw))))
    assert inside(section, local @ turn.T + (1.0, 2.0)).tolist() == [True, False, False, True, False]


def test_a_lying_cylinder_is_cut_along_its_axis() -> None:
    lying = (0.0, sin(pi / 4), 0.0, cos(pi / 4))
    section = cut(place(cylinder(0.2, 1.0, GREY), Pose((0.0, 0.0, 0.0), lying)), 0.1)
    assert section is not None
    half = sqrt(0.2**2 - 0.1**2)
    points = np.array([(0.49, half - 0.005), (0.51, 0.0), (0.0, half + 0.005)])
    assert inside(section, points).tolist() == [True, False, False]


def test_a_cut_pyramid_is_narrower_above() -> None:
    corners = ((1.0, 1.0, 0.0), (-1.0, 1.0, 0.0), (-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 0.0, 1.0))
    solid = place(hull(corners, GREY), Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    section = cut(solid, 0.75)
    assert section is not None
    assert inside(section, np.array([(0.24, 0.24), (0.26, 0.0)])).tolist() == [True, False]

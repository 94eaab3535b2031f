"""Drawn pictures of the table: what is clean, what stands about, and where the sponge is."""

from __future__ import annotations

import pytest

from aeros.sim.geometry import Camera
from aeros.sim.layouts.table import BIN, SPONGE_SIZE
from aeros.sim.perception.inspection import Inspection, inspect_table
from tests.shipped_scenes import overhead
from tests.unit.sim.perception.drawn import Top, draw

DIRT, FOAM, BLUE = (90, 80, 70), (220, 190, 60), (40, 60, 200)
SPONGE = Top(0.45, 0.34, 0.03, (0.05, 0.035), FOAM)


OVERHEAD_CAMERA = overhead("table")


def inspected(*tops: Top) -> Inspection:
    return inspect_table(draw(OVERHEAD_CAMERA, tops), OVERHEAD_CAMERA)


def test_a_bare_table_is_clean() -> None:
    assert inspected() == Inspection(None, 1.0, 0)


@pytest.mark.parametrize(
    ("tops", "clean"),
    [
        # The area is 0.3 m by 0.3 m around (0.5, 0).
        ([Top(0.425, 0.0, 0.0005, (0.075, 0.15), DIRT)], 0.5),
        ([Top(0.5, 0.0, 0.0005, (0.15, 0.15), DIRT)], 0.0),
        ([Top(0.5, 0.0, 0.0005, (0.03, 0.03), DIRT)], 1.0 - 0.04),
        # Dirt elsewhere does not count.
        ([Top(0.5, 0.3, 0.0005, (0.1, 0.05), DIRT)], 1.0),
        # As bright as 0.7 of the table around the area, and a little less.
        ([Top(0.5, 0.0, 0.0005, (0.15, 0.15), (145, 145, 145))], 1.0),
        ([Top(0.5, 0.0, 0.0005, (0.15, 0.15), (139, 139, 139))], 0.0),
        # What something hides is not clean.
        ([Top(0.425, 0.0, 0.1, (0.075, 0.15), BLUE)], 0.5),
    ],
)
def test_the_clean_share_is_that_of_the_areas_cells(tops: list[Top], clean: float) -> None:
    assert inspected(*tops).clean_share == pytest.approx(clean, abs=0.05)


def test_without_a_table_around_the_area_nothing_is_clean() -> None:
    assert inspected(Top(0.5, 0.0, 0.4, (0.9, 0.9), BLUE)).clean_share == 0.0


def test_the_sponge_is_where_its_foam_is_and_no_other_object() -> None:
    found = inspected(SPONGE)
    assert found.sponge == pytest.approx((0.45, 0.34, 0.03 - SPONGE_SIZE[2] / 2.0), abs=0.003)
    assert found.other_pixels == 0


def test_a_sponge_is_yellow_on_the_table_and_large_enough() -> None:
    for top in (
        SPONGE._replace(colour=BLUE),
        SPONGE._replace(z=0.31),
        SPONGE._replace(z=0.011),
        SPONGE._replace(half=(0.005, 0.005)),
        SPONGE._replace(y=0.56),
    ):
        assert inspected(top).sponge is None


def test_the_middle_is_that_of_the_highest_foam() -> None:
    found = inspected(SPONGE, Top(0.54, 0.34, 0.02, (0.04, 0.035), FOAM)).sponge
    assert found == pytest.approx((0.45, 0.34, 0.015), abs=0.003)


@pytest.mark.parametrize(
    ("top", "counts"),
    [
        (Top(0.5, 0.0, 0.04, (0.02, 0.02), BLUE), True),
        (Top(0.3, -0.3, 0.29, (0.02, 0.02), BLUE), True),
        (Top(0.5, 0.0, 0.011, (0.02, 0.02), BLUE), False),
        (Top(0.5, 0.0, 0.31, (0.02, 0.02), BLUE), False),
        # In the bin, and at its walls.
        (Top(BIN[0], BIN[1], 0.04, (0.08, 0.07), BLUE), False),
        (Top(BIN[0] + 0.15, BIN[1], 0.04, (0.02, 0.02), BLUE), True),
        # Where the arm does not work.
        (Top(0.18, 0.0, 0.04, (0.02, 0.02), BLUE), False),
        (Top(0.80, 0.0, 0.04, (0.02, 0.02), BLUE), False),
    ],
)
def test_objects_on_the_table_outside_the_bin_are_counted(top: Top, counts: bool) -> None:
    assert (inspected(top).other_pixels > 0) is counts


def test_points_next_to_the_sponge_belong_to_it() -> None:
    near, far = Top(0.45, 0.41, 0.02, (0.005, 0.005), BLUE), Top(0.45, 0.44, 0.02, (0.005, 0.005), BLUE)
    assert inspected(SPONGE, near).other_pixels == 0
    assert inspected(SPONGE, far).other_pixels > 0
    assert inspected(near).other_pixels > 0


NEAR = Camera(
    eye=(0.5, 0.12, 1.0),
    target=(0.5, 0.12, 0.0),
    up=(1.0, 0.0, 0.0),
    field_of_view=6.0,
    width=100,
    height=100,
)
"""Some hundred cells of 1 cm at the edge of the area, and table beyond it; 1 mm a pixel."""


@pytest.mark.parametrize(("dirty", "is_clean"), [(0.0038, True), (0.0062, False)])
def test_most_of_a_cells_pixels_decide(dirty: float, is_clean: bool) -> None:
    bars = [Top(0.5, 0.005 + 0.01 * row, 0.0005, (0.2, dirty / 2.0), DIRT) for row in range(15)]
    found = inspect_table(draw(NEAR, bars), NEAR).clean_share
    # Of the 900 cells the picture shows 9 rows of 12, some of them in part.
    assert found == pytest.approx(108 / 900 if is_clean else 0.0, abs=0.015)

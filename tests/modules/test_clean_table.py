"""Perceivers of `clean_table`: what is clean, what lies about, and where the sponge is."""

from __future__ import annotations

from dataclasses import replace
from math import dist, pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from aeros.perception import Picture
from aeros.sim.geometry import Camera, Pose, yaw_of, yaw_orientation
from tests.modules.looking import TABLE, Put, Top, Watched, draw
from tests.shipped_scenes import overhead

DIRT, FOAM, BLUE, GREEN = (90, 80, 70), (220, 190, 60), (40, 60, 200), (60, 180, 70)
BIN = (0.45, -0.50, 0.085)
REST = (0.45, 0.34, 0.015)
SPONGE = Top(0.45, 0.34, 0.03, (0.05, 0.035), FOAM)
OVERHEAD = replace(overhead("table"), eye=(0.47, -0.06, 1.45), target=(0.47, -0.06, 0.0))
"""The camera over the table; the table is drawn so that the middle of its area is at (0.5, 0)."""
PATCH = (0.03, 0.03)
PLACES = {
    "area_position": (0.5, 0.0, 0.0),
    "region": "whole",
    "bin_position": BIN,
    "sponge_rest_position": REST,
}


def seen(*tops: Top, camera: Camera = OVERHEAD, region: str = "whole") -> dict[str, Any]:
    watched = Watched("clean_table", "see_table", {**PLACES, "region": region})
    found: dict[str, Any] = watched.see(0.0, draw(camera, tops))
    return found


def verified(*tops: Top, region: str = "whole") -> bool:
    picture = draw(OVERHEAD, tops, name="mast")
    watched = Watched("clean_table", "check_table", {**PLACES, "region": region})
    found: bool = watched.see(0.0, picture)["table_verified"]
    return found


@pytest.mark.parametrize(
    ("tops", "clean"),
    [
        ([], 1.0),
        # The area is 0.3 m by 0.3 m around (0.5, 0).
        ([Top(0.425, 0.0, 0.0005, (0.075, 0.15), DIRT)], 0.5),
        ([Top(0.5, 0.0, 0.0005, (0.15, 0.15), DIRT)], 0.0),
        # A patch is no streak, and what is brighter than the table is no table.
        ([Top(0.5, 0.0, 0.0005, PATCH, DIRT)], 1.0 - 0.04),
        ([Top(0.5, 0.0, 0.0001, PATCH, (255, 255, 255))], 1.0 - 0.04),
        ([Top(0.5, 0.0, 0.0005, (0.15, 0.006), DIRT)], 1.0 - 0.04),
        # Dirt elsewhere does not count.
        ([Top(0.5, 0.3, 0.0005, (0.1, 0.05), DIRT)], 1.0),
        # As bright as 0.7 of the table around the area, and a little less.
        ([Top(0.5, 0.0, 0.0005, (0.15, 0.15), (145, 145, 145))], 1.0),
        ([Top(0.5, 0.0, 0.0005, (0.15, 0.15), (139, 139, 139))], 0.0),
        # What something hides is not known to be clean.
        ([Top(0.425, 0.0, 0.1, (0.075, 0.15), BLUE)], 0.5),
        # Without a table around the area nothing is.
        ([Top(0.5, 0.0, 0.4, (0.9, 0.9), BLUE)], 0.0),
    ],
)
def test_the_clean_share_is_that_of_the_areas_cells(tops: list[Top], clean: float) -> None:
    found = seen(*tops)
    assert found["wiped_fraction"] == pytest.approx(clean, abs=0.05)
    is_hidden = any(top.z > 0.01 for top in tops)
    is_wiped = found["wiped_fraction"] >= 0.95 and not any(top.half == PATCH for top in tops)
    assert found["table_wiped"] is (None if is_hidden else is_wiped)


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
    # Of the 900 cells the picture shows 9 rows of 12, some of them in part.
    found = seen(*bars, camera=NEAR)["wiped_fraction"]
    assert found == pytest.approx(108 / 900 if is_clean else 0.0, abs=0.015)


def test_a_sponge_is_yellow_on_the_table_and_large_enough() -> None:
    found = seen(SPONGE)
    assert found["sponge_position"] == pytest.approx(REST, abs=0.003)
    for top in (
        SPONGE._replace(colour=BLUE),
        SPONGE._replace(z=0.13),
        SPONGE._replace(z=0.011),
        SPONGE._replace(half=(0.005, 0.005)),
    ):
        other = seen(top)
        assert other["sponge_seen"] is False
        assert other.keys().isdisjoint({"sponge_position", "sponge_yaw"})


@pytest.mark.parametrize(
    ("half", "is_sponge"),
    [
        ((0.05, 0.035), True),
        ((0.0425, 0.03), True),  # 15 % smaller
        ((0.06, 0.042), True),  # 20 % larger
        ((0.02, 0.02), False),  # a yellow block
        ((0.021, 0.028), False),  # a plate of a wrapper
        ((0.1, 0.05), False),
    ],
)
def test_a_sponge_is_as_long_as_a_sponge(half: tuple[float, float], is_sponge: bool) -> None:
    for yaw in (0.0, 0.7):
        assert seen(SPONGE._replace(half=half, yaw=yaw))["sponge_seen"] is is_sponge


@pytest.mark.parametrize(
    ("colour", "is_yellow"),
    [
        ((200, 150, 50), True),
        ((200, 121, 99), True),
        ((200, 119, 50), False),
        ((200, 150, 101), False),
        ((60, 60, 0), False),
        ((61, 60, 0), True),
    ],
)
def test_a_pixel_is_as_yellow_as_a_sponge(colour: tuple[int, int, int], is_yellow: bool) -> None:
    assert seen(SPONGE._replace(colour=colour))["sponge_seen"] is is_yellow


@pytest.mark.parametrize(("off", "is_there"), [(0.024, True), (0.036, False)])
def test_a_sponge_is_at_its_rest_within_3_cm(off: float, is_there: bool) -> None:
    assert seen(SPONGE._replace(x=0.45 + off))["table_organized"] is is_there
    assert verified(SPONGE._replace(x=0.45 + off)) is is_there


@pytest.mark.parametrize(
    ("x", "y", "z", "in_bin"),
    [
        (0.45, -0.50, 0.04, True),
        (0.45 + 0.085, -0.50, 0.04, True),
        (0.45 + 0.095, -0.50, 0.04, False),
        (0.45, -0.50 + 0.075, 0.04, True),
        (0.45, -0.50 + 0.085, 0.04, False),
        # A little over the rim.
        (0.45, -0.50, 0.095, True),
    ],
)
def test_a_piece_in_the_bin_is_no_clutter(x: float, y: float, z: float, in_bin: bool) -> None:
    found = seen(SPONGE, Top(x, y, z, (0.02, 0.02), BLUE))
    assert (found["clutter_on_table"], found["table_organized"]) == (not in_bin, in_bin)


COLOURS = {
    "red": (200, 40, 30),
    "magenta": (200, 40, 190),
    "blue": BLUE,
    "green": GREEN,
    "yellow": FOAM,
    "white": (255, 255, 255),
    "black": (0, 0, 0),
    "the table's": (200, 200, 200),
}


@pytest.mark.parametrize("colour", COLOURS.values(), ids=COLOURS)
def test_a_block_of_any_colour_is_in_the_way_and_can_be_gripped(colour: tuple[int, int, int]) -> None:
    found = seen(SPONGE, Top(0.5, 0.05, 0.04, (0.02, 0.02), colour, 0.3))
    assert (found["clutter_on_table"], found["wiping_area_clear"], found["sponge_seen"]) == (
        True,
        False,
        True,
    )
    assert found["clutter_position"] == pytest.approx((0.5, 0.05, 0.02), abs=0.004)
    assert found["clutter_yaw"] == pytest.approx(0.3, abs=0.1)
    assert found["clutter_length"] == pytest.approx(0.04, abs=0.006)


@pytest.mark.parametrize(
    ("top", "fits"),
    [
        (Top(0.5, -0.25, 0.04, (0.028, 0.028), GREEN), True),
        (Top(0.5, -0.25, 0.04, (0.036, 0.036), GREEN), False),
        (Top(0.5, -0.25, 0.075, (0.02, 0.02), GREEN), True),
        (Top(0.5, -0.25, 0.09, (0.02, 0.02), GREEN), True),
        (Top(0.5, -0.25, 0.10, (0.02, 0.02), GREEN), False),
        (Top(0.5, -0.25, 0.04, (0.07, 0.02), GREEN), True),
        (Top(0.5, -0.25, 0.04, (0.08, 0.02), GREEN), False),
    ],
)
def test_a_piece_that_fits_neither_hand_nor_bin_is_seen_and_not_offered(top: Top, fits: bool) -> None:
    found = seen(SPONGE, top)
    assert (found["clutter_on_table"], found["table_organized"]) == (True, False)
    for name in ("clutter_position", "clutter_yaw", "clutter_length"):
        assert (name in found) is fits
    assert found["clutter_ungraspable"] is not fits
    assert fits or found["clutter_ungraspable_position"][:2] == pytest.approx((0.5, -0.25), abs=0.004)
    # The next one that fits is offered.
    other = seen(SPONGE, top, Top(0.65, -0.25, 0.04, (0.02, 0.02), BLUE))
    assert other["clutter_position"][0] == pytest.approx(0.5 if fits else 0.65, abs=0.004)
    assert other["clutter_ungraspable"] is not fits


@pytest.mark.parametrize("yaw", [-1.2, -0.6, 0.0, 0.9])
def test_a_long_piece_is_gripped_across(yaw: float) -> None:
    found = seen(Top(0.5, 0.05, 0.04, (0.06, 0.015), GREEN, yaw))
    assert apart(found["clutter_yaw"], yaw, pi) < 0.08
    assert found["clutter_length"] == pytest.approx(0.12, abs=0.006)


@pytest.mark.parametrize(
    ("beside", "heading"),
    [
        ([], 0.0),
        # The fingers close across the heading, along y: there is no room for them on one side.
        ([Top(0.585, -0.355, 0.04, (0.02, 0.02), BLUE)], pi / 2.0),
        ([Top(0.635, -0.30, 0.04, (0.02, 0.02), BLUE)], 0.0),
        # Low enough for the palm, and too high for it.
        ([Top(0.585, -0.385, 0.045, (0.02, 0.015), BLUE)], 0.0),
        ([Top(0.585, -0.385, 0.09, (0.02, 0.015), BLUE)], pi / 2.0),
    ],
)
def test_a_piece_is_gripped_where_fingers_have_room_beside_others(beside: list[Top], heading: float) -> None:
    found = seen(SPONGE, Top(0.58, -0.30, 0.04, (0.02, 0.02), GREEN), *beside)
    assert found["clutter_position"] == pytest.approx((0.58, -0.30, 0.02), abs=0.004)
    assert apart(found["clutter_yaw"], heading, pi) < 0.08


def test_a_piece_with_room_for_the_hand_comes_before_one_without() -> None:
    caught, free = Top(0.58, -0.30, 0.04, (0.02, 0.02), GREEN), Top(0.70, 0.35, 0.04, (0.02, 0.02), GREEN)
    walls = [Top(0.635, -0.30, 0.12, (0.01, 0.02), BLUE), Top(0.585, -0.355, 0.12, (0.02, 0.01), BLUE)]
    assert seen(SPONGE, caught, free)["clutter_position"][0] == pytest.approx(0.58, abs=0.004)
    # The walls themselves are too high for the hand.
    assert seen(SPONGE, caught, *walls, free)["clutter_position"][0] == pytest.approx(0.70, abs=0.004)


def test_a_thin_thing_that_stands_in_the_area_is_in_the_way() -> None:
    found = seen(SPONGE, Top(0.5, 0.0, 0.06, (0.1, 0.003), GREEN))
    assert (found["wiping_area_clear"], found["clutter_on_table"]) == (False, False)


def test_a_yellow_block_next_to_the_sponge_is_clutter_and_the_sponge_is_seen() -> None:
    found = seen(SPONGE, Top(0.54, 0.34, 0.04, (0.02, 0.02), FOAM))
    assert found["sponge_position"] == pytest.approx(REST, abs=0.003)
    assert found["clutter_position"] == pytest.approx((0.54, 0.34, 0.02), abs=0.004)


@pytest.mark.parametrize(
    ("tool", "is_clear", "is_cluttered"),
    [((0.5, 0.0, 0.2), None, None), ((0.2, -0.3, 0.2), False, True), (None, False, True)],
)
def test_the_hand_over_the_table_hides_it_and_is_not_in_the_way(
    tool: tuple[float, float, float] | None, is_clear: bool | None, is_cluttered: bool | None
) -> None:
    readings = PLACES if tool is None else {**PLACES, "tool_position": tool}
    hand = draw(OVERHEAD, [SPONGE, Top(0.5, 0.0, 0.25, (0.05, 0.1), (250, 250, 250))])
    found = Watched("clean_table", "see_table", readings).see(0.0, hand)
    assert (found["wiping_area_clear"], found["clutter_on_table"]) == (is_clear, is_cluttered)


def test_a_low_hand_hides_the_table_and_is_in_the_way() -> None:
    hand = draw(OVERHEAD, [SPONGE, Top(0.5, 0.0, 0.11, (0.05, 0.1), (250, 250, 250))])
    readings = {**PLACES, "tool_position": (0.5, 0.0, 0.02)}
    assert not Watched("clean_table", "see_table", readings).see(0.0, hand)["wiping_area_clear"]


def test_a_picture_without_the_table_says_neither_clear_nor_cluttered() -> None:
    picture = draw(OVERHEAD, [SPONGE])
    assert picture.depth is not None
    dazzled = replace(picture, rgb=np.full_like(picture.rgb, 255), depth=np.full_like(picture.depth, 10.0))
    found = Watched("clean_table", "see_table", PLACES).see(0.0, dazzled)
    unknown = {"wiped_fraction": 0.0, "table_wiped": None, "overhead_off": False}
    assert found == {"sponge_seen": False, "sponge_overturned": None, **unknown}


BLOCK = Top(0.45, 0.34, 0.064, (0.025, 0.02), (76, 115, 89))
"""What the hand grips the sponge by, on top of it."""


@pytest.mark.parametrize(
    ("tops", "is_overturned", "height"),
    [
        ([SPONGE, BLOCK], False, 0.015),
        ([SPONGE._replace(z=0.064)], True, 0.049),  # upside down
        ([SPONGE._replace(z=0.075, half=(0.05, 0.015))], True, 0.06),  # on its side
        ([SPONGE._replace(z=0.07), BLOCK._replace(z=0.104)], False, 0.055),  # on a cube
        ([SPONGE._replace(z=0.036, half=(0.06, 0.042))], False, 0.018),  # 20 % larger
    ],
)
def test_a_sponge_is_overturned_if_it_is_high_and_its_block_is_not_on_top(
    tops: list[Top], is_overturned: bool, height: float
) -> None:
    found = seen(*tops)
    assert (found["sponge_seen"], found["sponge_overturned"]) == (True, is_overturned)
    assert found["sponge_position"] == pytest.approx((0.45, 0.34, height), abs=0.005)
    assert found["sponge_top"] == pytest.approx(tops[0].z, abs=0.003)


CUBE_ON_BLOCK = Top(0.452, 0.338, 0.104, (0.02, 0.02), BLUE)


def test_a_thing_on_the_sponge_is_clutter_above_it_and_in_the_way() -> None:
    bare, covered = seen(SPONGE, BLOCK), seen(SPONGE, BLOCK, CUBE_ON_BLOCK)
    assert (bare["sponge_covered"], bare["wiping_area_clear"], bare["clutter_on_table"]) == (
        False,
        True,
        False,
    )
    assert (covered["sponge_covered"], covered["wiping_area_clear"]) == (True, False)
    assert covered["clutter_position"] == pytest.approx((0.452, 0.338, 0.084), abs=0.006)
    assert covered["clutter_length"] == pytest.approx(0.04, abs=0.006)
    assert not covered["clutter_ungraspable"]


def test_a_thing_on_the_foam_beside_its_block_is_clutter_too() -> None:
    found = seen(SPONGE, BLOCK._replace(half=(0.02, 0.016)), Top(0.49, 0.34, 0.06, (0.015, 0.03), BLUE))
    assert (found["sponge_covered"], found["clutter_on_table"]) == (True, True)


@pytest.mark.parametrize(
    ("height", "y", "is_clear"), [(0.09, -0.26, False), (0.05, -0.26, True), (0.09, -0.31, True)]
)
def test_a_high_thing_beside_the_area_is_in_the_hands_way(height: float, y: float, is_clear: bool) -> None:
    found = seen(SPONGE, Top(0.45, y, height, (0.01, 0.01), BLUE))
    assert found["wiping_area_clear"] is is_clear


def test_a_heap_is_gripped_by_its_upper_piece() -> None:
    found = seen(
        SPONGE, Top(0.45, -0.25, 0.04, (0.02, 0.02), BLUE), Top(0.45, -0.25, 0.09, (0.02, 0.02), GREEN)
    )
    assert found["clutter_position"] == pytest.approx((0.45, -0.25, 0.055), abs=0.005)


def test_the_first_piece_outside_the_bin_is_the_next_one() -> None:
    blue, green = Top(0.38, -0.25, 0.04, (0.02, 0.02), BLUE), Top(0.56, -0.25, 0.05, (0.02, 0.02), GREEN)
    assert seen(blue, green)["clutter_position"] == pytest.approx((0.38, -0.25, 0.02), abs=0.003)
    binned = blue._replace(x=0.45, y=-0.5)
    assert seen(binned, green)["clutter_position"] == pytest.approx((0.56, -0.25, 0.025), abs=0.003)


@pytest.mark.parametrize(
    ("x", "y", "is_clear"),
    [(0.5, 0.0, False), (0.295, 0.0, False), (0.285, 0.0, True), (0.5, -0.205, False), (0.5, -0.215, True)],
)
def test_a_piece_within_6_cm_of_the_area_is_in_the_way(x: float, y: float, is_clear: bool) -> None:
    assert seen(Top(x, y, 0.04, (0.02, 0.02), BLUE))["wiping_area_clear"] is is_clear


@pytest.mark.parametrize(
    ("top", "counts"),
    [
        (Top(0.5, 0.0, 0.04, (0.02, 0.02), BLUE), True),
        (Top(0.3, -0.3, 0.29, (0.02, 0.02), BLUE), True),
        (Top(0.3, -0.3, 0.011, (0.02, 0.02), BLUE), True),
        (Top(0.3, -0.3, 0.003, (0.02, 0.02), TABLE), True),
        (Top(0.3, -0.3, 0.001, (0.02, 0.02), TABLE), False),
        (Top(0.3, -0.3, 0.31, (0.02, 0.02), BLUE), False),
        # In the bin, and at its walls.
        (Top(BIN[0], BIN[1], 0.04, (0.08, 0.07), BLUE), False),
        (Top(BIN[0] + 0.15, BIN[1], 0.04, (0.02, 0.02), BLUE), True),
        # Where the arm does not work.
        (Top(0.18, 0.0, 0.04, (0.02, 0.02), BLUE), False),
        (Top(0.80, 0.0, 0.04, (0.02, 0.02), BLUE), False),
        # Next to the sponge it belongs to it.
        (Top(0.45, 0.41, 0.02, (0.005, 0.005), BLUE), False),
        (Top(0.45, 0.44, 0.02, (0.01, 0.01), BLUE), True),
    ],
)
def test_a_table_with_anything_else_on_it_is_not_verified(top: Top, counts: bool) -> None:
    assert verified(SPONGE, top) is not counts


def test_a_table_without_its_sponge_is_not_verified() -> None:
    assert verified(SPONGE)
    assert not verified()
    assert not verified(SPONGE._replace(z=0.31))


LEFT, RIGHT = (Top(0.5, side * 0.075, 0.0005, (0.15, 0.075), DIRT) for side in (1.0, -1.0))
"""Dirt on the left half of the area, and on the right half."""


CLEAR = (1.0, False, False, True, True)
"""Of an empty, clean half: share that is clean; clutter; in the way; organized; verified."""


@pytest.mark.parametrize(
    ("tops", "left", "right"),
    [
        ([], CLEAR, CLEAR),
        ([LEFT], (0.0, False, False, True, False), CLEAR),
        ([LEFT, RIGHT], (0.0, False, False, True, False), (0.0, False, False, True, False)),
        # Beside the area on the right; in the area on the left; across the middle.
        ([Top(0.4, -0.25, 0.04, (0.02, 0.02), BLUE)], CLEAR, (1.0, True, False, False, False)),
        ([Top(0.5, 0.10, 0.04, (0.02, 0.02), BLUE)], (0.96, True, True, False, False), CLEAR),
        (
            [Top(0.5, 0.0, 0.04, (0.02, 0.03), BLUE)],
            (0.97, True, True, False, False),
            (0.97, True, True, False, False),
        ),
        # On the right half, but where the sponge passes when it wipes the left half.
        (
            [Top(0.5, -0.03, 0.04, (0.02, 0.02), BLUE)],
            (1.0, False, True, True, True),
            (0.96, True, True, False, False),
        ),
    ],
)
def test_of_a_half_only_what_is_on_it_counts(
    tops: list[Top], left: tuple[Any, ...], right: tuple[Any, ...]
) -> None:
    for region, (clean, clutter, in_the_way, organized, is_verified) in (("left", left), ("right", right)):
        found = seen(SPONGE, *tops, region=region)
        assert found["wiped_fraction"] == pytest.approx(clean, abs=0.025), region
        assert (found["clutter_on_table"], found["table_organized"]) == (clutter, organized), region
        assert found["wiping_area_clear"] is not in_the_way, region
        assert ("clutter_position" in found) is clutter, region
        assert verified(SPONGE, *tops, region=region) is is_verified, region


def test_without_surveyed_places_no_verdict_is_given() -> None:
    picture = draw(OVERHEAD, [SPONGE])
    assert Watched("clean_table", "see_table").see(0.0, picture) == {}
    assert (
        Watched("clean_table", "see_table", {"area_position": PLACES["area_position"]}).see(0.0, picture)
        == {}
    )
    area = {name: PLACES[name] for name in ("area_position", "region")}
    found = Watched("clean_table", "see_table", area).see(0.0, picture)
    of_sponge = {"sponge_seen", "sponge_position", "sponge_yaw", "sponge_top", "sponge_overturned"}
    seen_table = {*of_sponge, "wiped_fraction", "table_wiped"}
    assert found.keys() == {*seen_table, "table_lift", "overhead_off"}
    mast = draw(OVERHEAD, [SPONGE], name="mast")
    assert Watched("clean_table", "check_table").see(0.0, mast) == {"table_verified": None}


# Pictures of the scene.


def apart(a: float, b: float, period: float) -> float:
    """Between two headings of what looks alike when turned by `period`."""
    return abs((a - b + period / 2.0) % period - period / 2.0)


def test_a_piece_that_two_pictures_do_not_show_is_missed() -> None:
    """Once it was in the bin it may be hidden by another: clutter is counted by its volume."""
    watched = Watched("clean_table", "see_table", {**PLACES, "holding": False})
    blue, green = Top(0.38, -0.25, 0.04, (0.02, 0.02), BLUE), Top(0.56, -0.25, 0.05, (0.02, 0.02), GREEN)
    binned = blue._replace(x=0.45, y=-0.5)
    shown = ([blue, green], [blue, green], [binned, green], [binned], [binned])
    found = [
        watched.see(float(time), draw(OVERHEAD, [SPONGE, *tops], time=float(time)))
        for time, tops in enumerate(shown)
    ]
    assert [one["clutter_missing"] for one in found] == [False, False, False, None, True]
    assert [one["table_organized"] for one in found] == [False, False, False, None, False]
    assert found[-1]["clutter_last_seen"] == pytest.approx((0.56, -0.25, 0.025), abs=0.004)


def table(seed: int = 3) -> tuple[Put, dict[str, Any]]:
    scene = Put("table", seed)
    places = {name: scene.poses[name].position for name in PLACES if name != "region"}
    return scene, {**places, "region": "whole"}


@pytest.mark.parametrize("seed", range(6))
def test_sponge_and_clutter_are_seen_where_they_are(seed: int) -> None:
    scene, places = table(seed)
    watched = Watched("clean_table", "see_table", places)
    found = watched.see(0.0, scene.look("overhead"))
    sponge, cube = scene.poses["sponge"], scene.poses["cube"]
    assert dist(found["sponge_position"][:2], sponge.position[:2]) < 0.003
    assert apart(found["sponge_yaw"], yaw_of(sponge.orientation), pi) < 0.08
    assert dist(found["clutter_position"], cube.position) < 0.003
    assert apart(found["clutter_yaw"], yaw_of(cube.orientation), pi / 2.0) < 0.1
    assert (found["clutter_on_table"], found["table_organized"], found["table_wiped"]) == (True, False, False)
    scene.remove("cube", "can")
    found = watched.see(1.0, scene.look("overhead", 1.0))
    assert (found["clutter_on_table"], found["table_organized"]) == (False, True)


def disturbed(picture: Picture, deviation: float, raised: float, tilted: float) -> Picture:
    """A picture with noise in its depth, of a camera that believes to be higher and to look elsewhere; m."""
    noise: NDArray[np.float64] = np.random.default_rng(7).normal(0.0, deviation, picture.rgb.shape[:2])
    assert picture.depth is not None
    (x, y, z), (u, v, w) = picture.eye, picture.target
    return replace(
        picture,
        depth=(picture.depth + noise).astype(np.float32),
        eye=(x, y, z + raised),
        target=(u + tilted, v, w + raised),
    )


@pytest.mark.parametrize(
    ("deviation", "raised", "tilted"),
    [(0.003, 0.0, 0.0), (0.0, 0.006, 0.0), (0.0, 0.0, 0.008), (0.002, -0.004, 0.006)],
)
@pytest.mark.parametrize("seed", range(3))
def test_a_camera_with_noise_or_askew_sees_what_stands_and_no_more(
    seed: int, deviation: float, raised: float, tilted: float
) -> None:
    scene, places = table(seed)
    watched = Watched("clean_table", "see_table", places)
    cube = scene.poses["cube"]
    found = watched.see(0.0, disturbed(scene.look("overhead"), deviation, raised, tilted))
    assert (found["clutter_on_table"], found["wiping_area_clear"]) == (True, True)
    assert dist(found["clutter_position"], cube.position) < 0.003 + tilted + 3.0 * deviation
    scene.put("cube", 0.5, -1.1, 0.02)
    found = watched.see(1.0, disturbed(scene.look("overhead", 1.0), deviation, raised, tilted))
    assert (found["clutter_on_table"], found["wiping_area_clear"]) == (True, False)
    for body, x in (("cube", 0.42), ("can", 0.48)):
        scene.put(body, x, -1.7, 0.03)
    found = watched.see(2.0, disturbed(scene.look("overhead", 2.0), deviation, raised, tilted))
    assert (found["clutter_on_table"], found["wiping_area_clear"]) == (False, True)


def test_the_mast_verifies_a_clean_table_with_its_sponge_and_nothing_else() -> None:
    scene, places = table()
    watched = Watched("clean_table", "check_table", places)

    def is_verified() -> bool:
        found: bool = watched.see(0.0, scene.look("mast"))["table_verified"]
        return found

    assert not is_verified()
    scene.coatings["dirt"].wiped[:] = True
    assert not is_verified(), "clutter is seen"
    for body, x in (("cube", 0.42), ("can", 0.48)):
        scene.put(body, x, -1.7, 0.03)
    assert is_verified()
    at = scene.poses["sponge"].position
    scene.poses["sponge"] = Pose((at[0], at[1] - 0.05, at[2]), yaw_orientation(0.2))
    assert not is_verified()


# What fell on the floor.


def test_a_sponge_is_missing_only_if_all_of_the_table_is_seen_and_the_hand_is_empty() -> None:
    watched = Watched("clean_table", "see_table", {**PLACES, "holding": False})
    arm = Top(0.5, 0.1, 0.5, (0.1, 0.1), (90, 90, 90))
    foam, shaded = SPONGE._replace(half=(0.02, 0.015)), SPONGE._replace(colour=(52, 44, 12))
    cube, over = (Top(REST[0], REST[1], 0.07, half, BLUE) for half in ((0.02, 0.02), (0.09, 0.11)))
    found = [
        watched.see(time, draw(OVERHEAD, tops, time=time)).get("sponge_missing")
        for time, tops in enumerate([[SPONGE], [], [cube], [arm], [foam], [shaded], [over]])
    ]
    assert found == [False, True, True, None, None, None, None]
    watched.readings["holding"] = True
    assert watched.see(9.0, draw(OVERHEAD, [], time=9.0))["sponge_missing"] is False


def test_a_rest_is_taken_if_something_else_stands_where_the_sponge_belongs() -> None:
    away = SPONGE._replace(x=0.55, y=0.0)
    box = Top(REST[0] + 0.02, REST[1] - 0.01, 0.06, (0.045, 0.045), BLUE)
    arm = Top(REST[0], REST[1], 0.35, (0.25, 0.25), (90, 90, 90))
    found = [
        seen(*tops)["rest_taken"]
        for tops in ([SPONGE], [away], [away, box], [away, box._replace(y=0.2)], [arm])
    ]
    assert found == [False, False, True, False, None]
    of_a_half = {half: seen(away, box, region=half) for half in ("left", "right")}
    assert {half: (one["rest_taken"], one["rest_blocked"]) for half, one in of_a_half.items()} == {
        "left": (True, False),
        "right": (True, True),
    }
    assert (seen(away)["rest_blocked"], seen(arm)["rest_blocked"]) == (False, None)
    spot = seen(away, box)["sponge_spot"]
    assert abs(spot[1] - box.y) > box.half[1] + 0.06 or abs(spot[0] - box.x) > box.half[0] + 0.06
    assert abs(spot[1]) > 0.15 + 0.05, "beside the area"
    assert spot[2] == pytest.approx(REST[2], abs=0.004)
    assert dist(spot, REST) < 0.2
    assert "sponge_spot" not in seen(away)
    full = [Top(0.5, y, 0.06, (0.25, 0.15), BLUE) for y in (0.35, -0.35)]
    assert abs(seen(away._replace(y=0.1), *full)["sponge_spot"][1]) < 0.15, (
        "in the area, as there is none beside it"
    )


LOST = {"area_position": (0.5, -1.2, 0.0), "base_position": (0.0, -1.2, 0.0)}
FLOOR = -0.30
"""Height of the scene's floor, m."""


def test_things_that_the_table_has_lost_are_found_on_the_floor() -> None:
    scene = Put("table")
    watched = Watched("clean_table", "see_floor", {**LOST, "sponge_seen": True, "clutter_missing": False})
    none = {"sponge_on_floor": False, "piece_on_floor": False}
    assert watched.see(0.0, scene.look("mast"), scene.look("overhead")) == none
    # What the table lacks may be where no picture shows it.
    watched.readings |= {"sponge_seen": False, "clutter_missing": True}
    assert watched.see(0.5) == {}
    sponge, cube = (0.15, -2.1, FLOOR + 0.015), (0.25, -2.2, FLOOR + 0.02)
    scene.put("sponge", *sponge)
    scene.put("cube", *cube)
    watched.readings |= {"sponge_seen": False, "clutter_missing": True}
    found = watched.see(1.0, scene.look("mast", 1.0))
    assert (found["sponge_on_floor"], found["piece_on_floor"]) == (True, True)
    assert dist(found["sponge_floor_position"], (*sponge[:2], FLOOR)) < 0.01
    assert dist(found["piece_floor_position"], (*cube[:2], FLOOR)) < 0.01
    # The camera over the table does not see that far, which changes nothing.
    assert watched.see(2.0, scene.look("overhead", 2.0))["sponge_on_floor"] is True
    # What is on the table again is on the floor no longer.
    watched.readings |= {"sponge_seen": True, "clutter_missing": False}
    assert watched.see(3.0) == none


def test_nothing_large_and_no_part_of_the_carriage_has_fallen() -> None:
    scene = Put("table")
    watched = Watched("clean_table", "see_floor", {**LOST, "sponge_seen": False, "clutter_missing": True})
    scene.put("bin", 0.15, -2.1, FLOOR + 0.005)
    scene.put("cube", 0.2, -1.0, FLOOR + 0.02)
    assert watched.see(0.0, scene.look("mast")) == {}

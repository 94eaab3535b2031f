"""Perceivers of `fetch_object`: where the can is, how it lies, where a hand has room, and if it is held."""

from __future__ import annotations

import runpy
from contextlib import suppress
from dataclasses import replace
from math import copysign, cos, dist, hypot, pi, sin
from typing import Any

import numpy as np
import pytest

from aeros.perception import Picture
from aeros.sim.geometry import Camera, Vector3
from aeros.skill import Action, ActionDenied
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from ecms.fetch_object import perceivers
from ecms.fetch_object.parts import parts_of
from ecms.fetch_object.search import Search
from ecms.fetch_object.stations import base_from
from tests.modules.looking import GREY, Put, Top, Watched, as_picture, draw

ABOVE = Camera(eye=(0.5, 0.1, 1.5), target=(0.5, 0.1, 0.0), up=(1.0, 0.0, 0.0), field_of_view=40.0)
"""Its picture is 1.09 m high (x) and 1.46 m wide (y), 4.5 mm a pixel."""

RED = (200, 30, 40)
STANDING = Top(0.6, 0.2, 0.08, (0.022, 0.0), RED, is_round=True)
DELIVERY = (1.7, -1.1, 0.44)
SURVEY = {"station_survey": (0.0, 0.2, 0.0), "delivery_position": DELIVERY}


def reference_site() -> Site:
    found = load_site(reference_site_path(), Diagnostics())
    assert found is not None
    return found


OBJECTS = {name: one.for_perceivers() for name, one in reference_site().objects.items()}
WANTED = {"object": "red_can", "to": "middle", "objects": OBJECTS}
"""What an instruction says of the task, and what the site says of its objects."""


def lying(heading: float) -> Top:
    """The upper side of a can on its side: a strip as long as it."""
    return Top(0.6, 0.2, 0.044, (0.04, 0.008), RED, heading)


def seen(picture: Picture, delivery: Vector3 = DELIVERY) -> dict[str, Any]:
    places = {**WANTED, **SURVEY, "delivery_position": delivery}
    found: dict[str, Any] = Watched("fetch_object", "find_object", places).see(0.0, picture)
    return found


def from_mast(*tops: Top) -> dict[str, Any]:
    return seen(draw(ABOVE, tops, name="mast"))


def wall(u: float, v: float, heading: float, half: tuple[float, float] = (0.01, 0.3)) -> Top:
    """A high wall at (u, v) along and across a heading from the can's middle."""
    x = 0.6 + u * cos(heading) - v * sin(heading)
    y = 0.2 + u * sin(heading) + v * cos(heading)
    return Top(x, y, 0.3, half, GREY, heading)


def test_a_standing_can_is_a_disc_and_can_be_gripped_at_any_heading() -> None:
    found = from_mast(STANDING)
    assert found["object_position"] == pytest.approx((0.6, 0.2, 0.04), abs=0.004)
    assert (found["object_lying"], found["object_yaw"], found["object_free"]) == (False, 0.0, True)
    assert found["object_push_start"] is None


@pytest.mark.parametrize("heading", [0.0, 0.6, -0.6, 1.5])
def test_a_lying_can_is_a_strip_and_is_gripped_across_its_axis(heading: float) -> None:
    found = from_mast(lying(heading))
    assert found["object_position"] == pytest.approx((0.6, 0.2, 0.022), abs=0.004)
    assert found["object_yaw"] == pytest.approx(heading, abs=0.1)
    assert (found["object_lying"], found["object_free"], found["object_push_way"]) == (True, True, None)
    assert found["object_free_across"] is False


def test_a_heading_is_from_minus_a_quarter_turn_on() -> None:
    assert from_mast(lying(pi - 0.6))["object_yaw"] == pytest.approx(-0.6, abs=0.1)
    assert from_mast(lying(-pi + 0.6))["object_yaw"] == pytest.approx(0.6, abs=0.1)


@pytest.mark.parametrize(("beyond", "is_seen"), [(0.52, True), (0.58, False)])
def test_a_red_thing_far_from_the_stands_is_no_can(beyond: float, is_seen: bool) -> None:
    # The picture shows y from -0.6 to 0.8 m. In the west is the aisle.
    for station in ((0.6, 0.2 - beyond, 0.0), (0.6 - beyond, 0.2, 0.0), (0.85 + beyond, 0.2, 0.0)):
        places = {**WANTED, "station_survey": station, "delivery_position": station}
        watched = Watched("fetch_object", "find_object", places)
        assert watched.see(0.0, draw(ABOVE, [STANDING], name="mast"))["object_seen"] is is_seen


@pytest.mark.parametrize("missing", SURVEY)
def test_while_the_stands_are_unknown_no_value_is_given_and_the_picture_is_kept(missing: str) -> None:
    known = {name: at for name, at in SURVEY.items() if name != missing}
    watched = Watched("fetch_object", "find_object", {**WANTED, **known})
    assert watched.see(0.0, draw(ABOVE, [STANDING], name="mast")) == {}
    watched.readings |= SURVEY
    assert watched.see(0.1)["object_seen"] is True


def test_without_enough_red_there_is_no_can() -> None:
    blue, dark = STANDING._replace(colour=(40, 30, 200)), STANDING._replace(colour=(55, 5, 5))
    pink, small = STANDING._replace(colour=(200, 30, 105)), STANDING._replace(half=(0.008, 0.0))
    for tops in ([], [blue], [dark], [pink], [small]):
        found = from_mast(*tops)
        assert {name for name, value in found.items() if value is not None} == {
            "object_seen",
            "object_searched",
            "object_absent",
            "object_unlike",
            "search_darkened",
        }
        named = ("object_seen", "object_absent", "object_unlike", "search_darkened")
        assert [found[name] for name in named] == [False] * 4


def test_the_searched_area_grows_until_the_object_is_seen() -> None:
    watched = Watched("fetch_object", "find_object", {**WANTED, **SURVEY})
    first = watched.see(0.0, draw(ABOVE, [], name="mast"))["object_searched"]
    assert 0.1 < first < 1.0
    again = watched.see(1.0, draw(ABOVE, [], name="mast", time=1.0))["object_searched"]
    assert again == pytest.approx(first, abs=0.02)
    seen_now = watched.see(2.0, draw(ABOVE, [STANDING], name="mast", time=2.0))
    assert (seen_now["object_seen"], seen_now["object_searched"]) == (True, 0.0)


def test_a_standing_can_next_to_a_wall_is_gripped_at_the_other_heading() -> None:
    # The hand needs 0.06 m along its x and 0.115 m across; 2 cm above the can is room for anything.
    assert from_mast(STANDING, wall(0.08, 0.0, 0.0))["object_free"] is True
    assert from_mast(STANDING, wall(0.05, 0.0, 0.0))["object_free"] is False
    assert from_mast(STANDING)["object_free_across"] is True
    assert from_mast(STANDING, wall(0.08, 0.0, 0.0))["object_free_across"] is False
    beside = Top(0.6, 0.3, 0.3, (0.02, 0.01), GREY)
    assert from_mast(STANDING, beside)["object_yaw"] == pytest.approx(pi / 2.0)
    assert from_mast(STANDING, beside._replace(z=0.095))["object_yaw"] == 0.0


def test_fingers_come_down_beside_a_low_block_and_not_on_it() -> None:
    block = Top(0.6, 0.2 + 0.051, 0.05, (0.02, 0.02), GREY)
    assert from_mast(STANDING, block)["object_yaw"] == pytest.approx(pi / 2.0)
    assert from_mast(STANDING, block._replace(z=0.03))["object_yaw"] == 0.0, "lower than the fingertips"
    assert from_mast(STANDING, block._replace(y=0.2 + 0.09))["object_yaw"] == 0.0, "farther than the fingers"
    both = from_mast(STANDING, block, Top(0.6 + 0.051, 0.2, 0.05, (0.02, 0.02), GREY))
    assert (both["object_yaw"], both["object_free"]) == (0.0, True), "what is loose may give way"


def test_a_standing_can_without_room_is_not_pushed() -> None:
    found = from_mast(STANDING, wall(0.05, 0.0, 0.0))
    assert (found["object_free"], found["object_push_start"]) == (False, None)


@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_a_lying_can_beside_a_short_wall_is_pushed_along_its_axis_past_the_nearer_end(heading: float) -> None:
    # Beside the can, 8 cm across its axis, from 20 cm behind its middle to 7 cm ahead.
    found = from_mast(lying(heading), wall(-0.065, 0.08, heading, (0.135, 0.01)))
    assert found["object_free"] is False
    axis, way, (x, y, z) = found["object_yaw"], found["object_push_way"], found["object_push_start"]
    assert 0.12 <= way[0] * cos(axis) + way[1] * sin(axis) <= 0.16
    assert way[1] * cos(axis) - way[0] * sin(axis) == pytest.approx(0.0, abs=1e-9)
    # The fingers come down 8 cm behind the middle, at most 27 mm off the axis and away from the wall.
    assert (x - 0.6) * cos(axis) + (y - 0.2) * sin(axis) == pytest.approx(-0.08, abs=0.005)
    assert -0.032 < (y - 0.2) * cos(axis) - (x - 0.6) * sin(axis) < 0.005
    assert z == found["object_position"][2]


def test_a_can_is_not_pushed_where_something_stops_the_hand_on_its_way() -> None:
    beside = wall(-0.065, 0.08, 0.0, (0.135, 0.01))
    assert from_mast(lying(0.0), beside)["object_push_start"] is not None
    # The hand has room where it comes down, and where it would grip, but not between.
    between = wall(0.085, 0.0, 0.0, (0.01, 0.03))
    assert from_mast(lying(0.0), beside, between)["object_push_start"] is None


@pytest.mark.parametrize(("ends", "offset"), [(-0.075, 0.0), (-0.051, 0.014), (-0.044, 0.02), (-0.03, None)])
def test_a_lying_can_is_gripped_beside_its_middle_where_the_hand_has_no_room_there(
    ends: float, offset: float | None
) -> None:
    # A wall beside the can, 8 cm across its axis, which ends before its middle.
    found = from_mast(lying(0.0), wall(ends - 0.15, 0.08, 0.0, (0.15, 0.01)))
    assert found["object_free"] is (offset is not None)
    assert found["object_grip_offset"] == pytest.approx((offset or 0.0, 0.0, 0.0), abs=0.007)


def test_between_long_walls_nothing_can_be_pushed() -> None:
    # 10 cm high, so that the picture shows as much of them as of the table.
    walls = [wall(0.0, side, 0.0, (0.9, 0.01))._replace(z=0.1) for side in (-0.07, 0.07)]
    found = from_mast(lying(0.0), *walls)
    assert (found["object_free"], found["object_push_start"]) == (False, None)


OBLIQUE = Camera((0.0, 0.2, 0.8), (0.6, 0.0, 0.0))


def room(can: Vector3, axis: float | None = None) -> Put:
    """The scene `fetch` with everything but the can and the decoy out of sight, on its floor."""
    scene = Put("fetch")
    scene.remove("stand", "delivery_stand", "decoy")
    half = ((axis or 0.0) / 2, pi / 4)
    lying = (-sin(half[0]) * sin(half[1]), cos(half[0]) * sin(half[1]), sin(half[0]) * cos(half[1]),
             cos(half[0]) * cos(half[1]))  # fmt: skip
    scene.put("can", *can, *(() if axis is None else (lying,)))
    return scene


@pytest.mark.parametrize("place", [(0.6, 0.0), (0.5, 0.15), (0.7, -0.1)])
@pytest.mark.parametrize("axis", [None, 0.0, 0.8, -1.3])
def test_a_red_can_is_found_within_5_mm_and_a_blue_box_is_not(
    place: tuple[float, float], axis: float | None
) -> None:
    x, y = place
    middle = (x, y, 0.04 if axis is None else 0.022)
    scene = room(middle, axis)
    scene.put("decoy", x, y - 0.15, 0.025)
    found = seen(scene.look("mast", camera=OBLIQUE))
    assert dist(found["object_position"], middle) < 0.005
    assert found["object_lying"] is (axis is not None)
    assert found["object_yaw"] == pytest.approx(axis or 0.0, abs=0.12)
    scene.remove("can")
    assert seen(scene.look("mast", camera=OBLIQUE))["object_seen"] is False


@pytest.mark.parametrize("seed", range(4))
def test_noise_in_depth_does_not_make_a_can_higher(seed: int) -> None:
    # Else it seems larger than what the fingers then hold, and is let go.
    scene = room((0.6, 0.0, 0.04))
    scene.put("delivery_stand", 0.6, 0.0, -0.2)
    clear = scene.look("mast", camera=OBLIQUE)
    assert clear.depth is not None
    noise = np.random.default_rng(seed).normal(0.0, 0.005, clear.depth.shape)
    found = seen(as_picture(OBLIQUE, clear.rgb, clear.depth + noise, "mast"))
    assert found["object_position"][2] == pytest.approx(0.04, abs=0.004)
    assert found["object_scale"] == 1.0


@pytest.mark.parametrize(("at", "way"), [(0.0, -0.24), (0.15, 0.20)])
def test_a_can_lying_at_a_wall_is_pushed_along_it_past_its_nearer_end(at: float, way: float) -> None:
    # The delivery's stand, 26 cm by 50 cm, with its side 8 mm behind the can and its middle at y = 0.06.
    scene = room((0.6, at, 0.022), pi / 2)
    scene.put("delivery_stand", 0.6 + 0.022 + 0.008 + 0.13, 0.06, 0.2)
    found = seen(scene.look("mast", camera=OBLIQUE))
    assert found["object_free"] is False
    assert dist(found["object_push_way"], (0.0, way, 0.0)) < 0.06
    # From behind, and off the wall.
    x, y, _ = found["object_push_start"]
    assert y == pytest.approx(at - copysign(0.08, way), abs=0.01)
    assert 0.57 < x < 0.59


def test_a_few_red_pixels_are_not_an_object() -> None:
    rgb = np.full((240, 320, 3), 128, dtype=np.uint8)
    for rows, is_seen in ((104, False), (110, True)):
        rgb[100:rows, 100:106] = (200, 10, 10)
        picture = as_picture(ABOVE, rgb.copy(), np.ones((240, 320)), "mast")
        assert seen(picture)["object_seen"] is is_seen


@pytest.mark.parametrize(
    ("off", "is_lying", "is_delivered"),
    [
        ((0.0, 0.0, 0.0), False, True),
        ((0.015, 0.015, 0.0), False, True),
        # 25.5 mm in the picture, whose error is 5 mm, may be more than 3 cm.
        ((0.018, 0.018, 0.0), False, False),
        # The stand may be 20 mm higher than it was surveyed; what is much higher is no stand.
        ((0.0, 0.0, 0.02), False, True),
        ((0.0, 0.0, 0.045), False, False),
        # A can that lies is 18 mm lower: its radius is 22 mm, half its height 40 mm.
        ((0.0, 0.0, 0.0), True, True),
        ((0.0, 0.0, 0.045), True, False),
    ],
)
def test_a_can_is_delivered_if_it_is_surely_within_3_cm_on_what_may_be_the_stand(
    off: Vector3, is_lying: bool, is_delivered: bool
) -> None:
    delivery = (0.6 - off[0], 0.2 - off[1], 0.04 - off[2])
    found = seen(draw(ABOVE, [lying(0.3) if is_lying else STANDING], name="mast"), delivery)
    assert found["object_delivered"] is is_delivered


def test_an_object_that_is_not_seen_is_elsewhere_only_if_each_place_for_it_is_seen_empty() -> None:
    stand = Top(0.6, 0.2, 0.02, (0.13, 0.25), GREY)
    arm = Top(0.6, 0.3, 0.5, (0.06, 0.06), (90, 90, 90))
    dark = stand._replace(colour=(40, 40, 40))
    for tops, is_delivered in (([stand], False), ([stand, arm], None), ([dark], None), ([], False)):
        height = 0.06 if tops else 0.04
        given = {**WANTED, "to": "anywhere", **SURVEY, "delivery_position": (0.6, 0.2, height)}
        watched = Watched("fetch_object", "find_object", given)
        assert watched.see(0.0, draw(ABOVE, tops, name="mast"))["object_delivered"] is is_delivered
    # Where it is seen, it is nowhere else; over its place the hand may still hold it.
    assert seen(draw(ABOVE, [STANDING], name="mast"))["object_delivered"] is False


def test_the_hand_sees_where_the_can_is_and_how_it_lies() -> None:
    search = {
        "object_searched": 0.0,
        "object_absent": False,
        "object_unlike": False,
        "object_unlike_place": None,
        "search_darkened": False,
        "object_dark_place": None,
    }
    assert seen(draw(ABOVE, [], name="hand")) == {"object_seen": False, **search}
    standing = seen(draw(ABOVE, [STANDING], name="hand"))
    of_it = {"object_seen", "object_seen_time", "object_position", "object_lying"}
    assert standing.keys() == of_it | search.keys()
    assert seen(draw(ABOVE, [lying(0.5)], name="hand"))["object_yaw"] == pytest.approx(0.5, abs=0.1)


def test_a_value_that_a_later_picture_does_not_show_keeps_its_time() -> None:
    watched = Watched("fetch_object", "find_object", {**WANTED, **SURVEY})
    watched.see(1.0, draw(ABOVE, [lying(0.0), wall(-0.065, 0.08, 0.0, (0.135, 0.01))], name="mast", time=1.0))
    found = watched.see(2.0, draw(ABOVE, [], name="hand", time=2.0))
    assert (found["object_seen"], found["object_free"]) == (False, False)
    assert (watched.answer["object_seen"].time, watched.answer["object_free"].time) == (2.0, 1.0)
    # A picture without a possible push removes the earlier one.
    assert found["object_push_start"] is not None
    assert watched.see(3.0, draw(ABOVE, [lying(0.0)], name="mast", time=3.0))["object_push_start"] is None


# What is felt, and where to drive.

STATION = (-0.05, 2.4, 0.0)
CAN = (0.53, 2.4, 0.141)
EMPTY = {
    **WANTED,
    "holding": False,
    "finger_gap": 0.08,
    "base_position": (0.0, 0.0, 0.0),
    "station_survey": STATION,
}


def tracked(time: float, **readings: Any) -> dict[str, Any]:
    found: dict[str, Any] = Watched("fetch_object", "track", {**EMPTY, **readings}).see(time)
    return found


@pytest.mark.parametrize(
    ("holding", "gap", "is_held"),
    [(True, 0.044, True), (True, 0.040, False), (True, 0.049, False), (False, 0.044, False)],
)
def test_a_can_is_held_between_fingers_as_far_apart_as_it_is_wide(
    holding: bool, gap: float, is_held: bool
) -> None:
    assert tracked(0.0, holding=holding, finger_gap=gap)["object_grasped"] is is_held


def test_without_a_gripper_nothing_is_known_of_the_hand() -> None:
    watched = Watched("fetch_object", "track", {"station_survey": STATION, "base_position": STATION})
    found = watched.see(0.0)
    assert (found["object_grasped"], found["object_detected"]) == (None, None)
    assert found["robot_at_target"] is True
    felt = Watched("fetch_object", "track").see(0.0)
    assert felt.keys() == {"object_grasped", "object_detected", "object_slips", "object_slips_out"}
    assert set(felt.values()) == {None}


@pytest.mark.parametrize(
    ("seen_at", "held", "time", "is_detected"),
    [
        (None, False, 0.0, False),
        (None, True, 0.0, True),
        (5.0, False, 35.0, True),
        (5.0, False, 35.01, False),
    ],
)
def test_a_picture_counts_for_half_a_minute_and_a_grip_while_it_lasts(
    seen_at: float | None, held: bool, time: float, is_detected: bool
) -> None:
    of_picture = {} if seen_at is None else {
        "object_seen": True, "object_seen_time": seen_at, "object_position": CAN,
    }  # fmt: skip
    gap = {"holding": True, "finger_gap": 0.044} if held else {}
    found = tracked(time, **of_picture, **gap)
    assert (found["object_detected"], found["object_grasped"]) == (is_detected, held)
    assert found["station_position"] == STATION


def test_a_picture_from_before_the_can_was_held_no_longer_counts() -> None:
    watched = Watched("fetch_object", "track", {**EMPTY, "object_seen": True, "object_seen_time": 1.0})
    assert watched.see(2.0)["object_detected"] is True
    watched.readings |= {"holding": True, "finger_gap": 0.044}
    assert watched.see(3.0)["object_detected"] is True
    watched.readings |= {"holding": False}
    assert watched.see(4.0)["object_detected"] is False
    watched.readings |= {"object_seen_time": 5.0}
    assert watched.see(5.0)["object_detected"] is True


@pytest.mark.parametrize(
    ("place", "before_it"),
    [
        ((0.33, 2.40, 0.0), False),
        ((0.33, 2.46, 0.0), True),
        ((0.18, 2.30, 0.0), True),
        ((0.54, 2.30, 0.0), True),
    ],
)
def test_the_station_moves_to_a_can_seen_out_of_reach_or_far_to_the_side(
    place: Vector3, before_it: bool
) -> None:
    station = (-0.25, 2.30, 0.0)
    found = tracked(
        1.0, station_survey=station, object_seen=True, object_seen_time=1.0, object_position=place
    )
    there = pytest.approx((place[0] - 0.58, place[1], 0.0))
    assert found["station_position"] == (there if before_it else station)


def test_the_robot_does_not_leave_the_floor_to_reach_a_can() -> None:
    seen_now = {"object_seen": True, "object_seen_time": 1.0}
    for place, station in (((0.7, 2.9, 0.0), (0.03, 2.595, 0.0)), ((-1.1, -1.7, 0.0), (-0.595, -1.295, 0.0))):
        assert tracked(1.0, **seen_now, object_position=place)["station_position"] == station


def test_the_robot_does_not_drive_towards_a_can_that_it_cannot_reach_from_anywhere() -> None:
    seen_now = {"object_seen": True, "object_seen_time": 1.0}
    values = tracked(1.0, **seen_now, object_position=(9.0, 9.0, 0.0))
    assert values["station_position"] == (0.0, 0.0, 0.0), "where it is"
    assert (values["robot_at_target"], values["object_out_of_reach"]) == (True, True)
    assert values["object_distance"] == pytest.approx(dist((9.0, 9.0), (0.03, 2.595)))
    old = tracked(31.1, **seen_now, object_position=(9.0, 9.0, 0.0))
    assert old["station_position"] == STATION


@pytest.mark.parametrize(
    ("base", "is_there"),
    [((-0.05, 2.429, 0.0), True), ((-0.05, 2.431, 0.0), False), ((-0.05, 2.4, 9.0), True)],
)
def test_the_robot_is_at_its_station_within_3_cm(base: Vector3, is_there: bool) -> None:
    assert tracked(0.0, base_position=base)["robot_at_target"] is is_there


@pytest.mark.parametrize(
    ("scale", "is_lying", "above"),
    [(1.0, False, 0.04), (1.2, False, 0.048), (0.85, False, 0.034), (1.2, True, 0.0264)],
)
def test_the_middle_of_a_larger_can_belongs_higher_over_the_stand(
    scale: float, is_lying: bool, above: float
) -> None:
    found = tracked(
        0.0, delivery_position=DELIVERY, object_scale=scale, object_lying=is_lying, stand_lift=0.01
    )
    x, y, z = DELIVERY
    assert found["object_place"] == pytest.approx((x, y, z - 0.04 + 0.01 + above))


def beside(u: float, v: float) -> Top:
    """A high thing whose nearest corner is at (u, v) beyond the can and to its left."""
    half = (0.15, 0.08)
    return Top(0.6 + u + half[0], 0.2 + v + copysign(half[1], v), 0.3, half, GREY)


@pytest.mark.parametrize(
    ("thing", "aside"),
    [
        # The forearm is wider to the left, and is on this side of the can.
        (beside(-0.07, 0.115), -0.10),
        (beside(-0.07, -0.115), 0.0),
        (beside(0.0, 0.115), 0.0),
        (beside(-0.07, 0.115)._replace(z=0.15), 0.0),
    ],
)
def test_the_base_stands_aside_where_the_forearm_would_hit_something(thing: Top, aside: float) -> None:
    assert from_mast(STANDING, thing)["object_aside"] == aside
    u, v = (0.58**2 - aside**2) ** 0.5, -aside
    found = tracked(
        1.0, object_aside=aside, object_seen=True, object_seen_time=1.0, object_position=(0.6, 0.2, 0.04)
    )
    assert found["station_position"] == pytest.approx((max(-0.595, 0.6 - u), 0.2 - v, 0.0))


def test_the_base_stays_aside_until_the_can_lies_elsewhere() -> None:
    watched = Watched("fetch_object", "find_object", {**WANTED, **SURVEY})
    watched.see(0.0, draw(ABOVE, [STANDING, beside(-0.07, 0.115)], name="mast"))
    assert watched.see(1.0, draw(ABOVE, [STANDING], name="mast", time=1.0))["object_aside"] == -0.10
    moved = STANDING._replace(y=0.3)
    assert watched.see(2.0, draw(ABOVE, [moved], name="mast", time=2.0))["object_aside"] == 0.0


def test_when_all_was_looked_over_the_base_stays_for_another_look() -> None:
    here = (-0.39, 1.0, 0.0)
    found = tracked(1.0, base_position=here, object_absent=True)
    assert (found["station_position"], found["robot_at_target"]) == (here, True)
    seen_now = {"object_seen": True, "object_seen_time": 1.0, "object_position": CAN}
    assert tracked(1.0, base_position=here, object_absent=True, **seen_now)["robot_at_target"] is False
    assert tracked(1.0, base_position=here, object_absent=False)["station_position"] == STATION


THERE, USUALLY = (1.7, -1.0, 0.4), (1.8, 0.2, 0.4)
RECALLED = {"position": THERE, "age": 60.0, "usual": USUALLY, "sessions": 5.0}


@pytest.mark.parametrize(
    ("in_session", "usual_sessions", "expected"),
    [(True, 5.0, THERE), (False, 3.0, USUALLY), (False, 2.0, THERE)],
)
def test_an_object_is_expected_where_it_was_in_this_session_or_usually_is(
    in_session: bool, usual_sessions: float, expected: Vector3
) -> None:
    row = {**RECALLED, "in_session": in_session, "usual_sessions": usual_sessions}
    readings = {"object": "red_can", "memory": {"object.red_can": row}}
    assert Watched("fetch_object", "remember", readings).see(0.0) == {"object_expected_place": expected}


def test_an_object_that_memory_does_not_know_is_expected_nowhere() -> None:
    row = {**RECALLED, "in_session": True, "usual_sessions": 5.0}
    for memory in ({}, {"object.blue_block": row}):
        readings = {"object": "red_can", "memory": memory}
        assert Watched("fetch_object", "remember", readings).see(0.0) == {}


@pytest.mark.parametrize(
    ("expected", "places"),
    [
        (None, [(-0.05, 2.4)]),
        ((0.5, 2.3, 0.1), [(-0.05, 2.4)]),
        ((0.5, 0.95, 0.1), [(-0.45, 0.95), (-0.05, 2.4)]),
        ((0.5, -2.0, 0.1), [(-0.45, pytest.approx(0.71)), (-0.05, 2.4)]),
    ],
    ids=["nowhere", "at the station", "elsewhere", "beyond where the mast is searched from"],
)
def test_the_base_goes_first_abreast_of_an_object_that_is_expected_elsewhere(
    expected: Vector3 | None, places: list[tuple[float, float]]
) -> None:
    observed: dict[str, Any] = {
        **EMPTY,
        "tool_position": (0.3, 0.0, 0.5),
        "station_position": STATION,
        "delivery_position": (0.48, 1.1, 0.14),
        "object_detected": False,
    }
    if expected is not None:
        observed["object_expected_place"] = expected
    actions = actions_of("navigate", observed)
    driven = [(one.parameters["x"], one.parameters["y"]) for one in actions if one.kind == "move_base"]
    assert driven == places
    looks = [one.parameters["camera"] for one in actions if one.kind == "look"]
    assert looks.count("mast") == len(places) - 1
    assert looks.count("aisle_top") == len(places), "the aisle is looked along before each drive"


def actions_of(skill: str, observed: dict[str, Any]) -> list[Action]:
    """The actions of a skill that observes the same all the time."""
    body = runpy.run_module("ecms.fetch_object.skills")[skill](observed, {"hand_speed": 0.45})
    actions = [next(body)]
    with suppress(StopIteration):
        while True:
            actions.append(body.send(observed))
    return actions


@pytest.mark.parametrize(
    ("observed", "headings"),
    [
        ({"holding": False}, [0.3, 0.3 - pi / 2.0]),
        ({"holding": False, "object_yaw": -0.3}, [-0.3, -0.3 + pi / 2.0]),
        ({"holding": True}, [0.3]),
        ({"holding": False, "object_free_across": False}, [0.3]),
        ({"holding": False, "object_lying": True}, [0.3]),
    ],
    ids=["missed", "turned the other way", "held", "no room across", "lying"],
)
def test_an_object_that_the_fingers_miss_is_gripped_once_more_by_its_other_sides(
    observed: dict[str, Any], headings: list[float]
) -> None:
    known: dict[str, Any] = {
        "tool_position": (0.3, 0.0, 0.5),
        "base_position": (0.0, 0.0, 0.0),
        "object_position": (0.5, 0.0, 0.1),
        "object_yaw": 0.3,
        "object_free": True,
        "object_grip_height": 0.012,
        "object_free_across": True,
        "object_lying": False,
    }
    actions = actions_of("grasp", {**known, **observed})
    closed = [at for at, one in enumerate(actions) if one.kind == "grip" and one.parameters["width"] < 0.05]
    assert [actions[at - 1].parameters["yaw"] for at in closed] == pytest.approx(headings)


OVER_AISLE = Camera(eye=(0.2, -1.0, 3.0), target=(0.2, -1.0, 0.0), up=(1.0, 0.0, 0.0), field_of_view=59.0)
"""Over the floor, 300 mm below the arm's base; its picture is 14 mm a pixel, as in the reference cell."""

ON_FLOOR = Top(0.3, -0.9, 0.08, (0.022, 0.0), RED, is_round=True)
BASE = {"base_position": (-0.4, 0.2, 0.3)}


def from_above(*tops: Top) -> Any:
    watched = Watched("fetch_object", "find_object", {**WANTED, **SURVEY, **BASE})
    return watched.see(0.0, draw(OVER_AISLE, tops, name="aisle_top", ground=GREY))


def test_the_camera_over_the_aisle_finds_a_can_on_the_floor() -> None:
    found = from_above(ON_FLOOR)
    assert (found["object_seen"], found["object_lying"], found["object_free"]) == (True, False, True)
    assert found["object_position"] == pytest.approx((0.3, -0.9, 0.04), abs=0.012)


def test_it_sees_how_a_can_lies() -> None:
    found = from_above(Top(0.3, -0.9, 0.044, (0.04, 0.022), RED, yaw=0.6))
    assert found["object_lying"] is True
    assert found["object_yaw"] == pytest.approx(0.6, abs=0.25)
    assert found["object_position"] == pytest.approx((0.3, -0.9, 0.022), abs=0.012)


@pytest.mark.parametrize(
    "top",
    [
        ON_FLOOR._replace(z=0.5),
        ON_FLOOR._replace(x=-0.3, y=0.2),
        ON_FLOOR._replace(colour=(40, 30, 200)),
        ON_FLOOR._replace(half=(0.2, 0.0)),
    ],
    ids=["on a stand", "at the carriage", "blue", "too large"],
)
def test_the_mast_decides_about_all_but_a_can_on_the_floor(top: Top) -> None:
    found = from_above(top)
    assert "object_seen" not in found
    if top.colour == RED:
        assert found == {}, "what may be the can counts for no look either"


def test_a_mast_that_does_not_show_the_place_takes_no_can_away_and_one_that_shows_it_does() -> None:
    watched = Watched("fetch_object", "find_object", {**WANTED, **SURVEY, **BASE})
    watched.see(0.0, draw(OVER_AISLE, [ON_FLOOR], name="aisle_top", ground=GREY))
    aside = replace(ABOVE, eye=(0.5, 0.9, 1.5), target=(0.5, 0.9, 0.0))
    assert watched.see(1.0, draw(aside, [], name="mast", time=1.0))["object_seen"] is True
    there = replace(ABOVE, eye=(0.3, -0.9, 1.5), target=(0.3, -0.9, 0.0))
    assert watched.see(2.0, draw(there, [], name="mast", time=2.0))["object_seen"] is False


def test_a_can_that_only_the_camera_over_the_aisle_saw_is_looked_for_there_again() -> None:
    watched = Watched("fetch_object", "find_object", {**WANTED, **SURVEY, **BASE})
    for time, tops in enumerate(([ON_FLOOR], [ON_FLOOR._replace(y=-1.2)], [])):
        found = watched.see(float(time), draw(OVER_AISLE, tops, name="aisle_top", time=time, ground=GREY))
        assert found["object_seen"] is bool(tops)
        if tops:
            assert found["object_position"] == pytest.approx((0.3, tops[0].y, 0.04), abs=0.012)
            assert found["object_searched"] == 0.0
    assert found["object_searched"] > 0.1


def test_grey_floor_at_the_robot_counts_as_searched_for_no_grey_object() -> None:
    picture = draw(OVER_AISLE, [], name="aisle_top", ground=GREY)
    red, grey = (
        perceivers.Kind("cylinder", (0.02, 0.08), (0.8, 0.1, 0.1)),
        perceivers.Kind("cylinder", (0.02, 0.08), (0.5, 0.5, 0.5)),
    )
    given = {"base_position": (0.1, -0.9, 0.3), "tool_position": (0.5, -0.9, 0.6)}
    shown = [len(perceivers._floor_points(picture, kind, given)[0]) for kind in (red, grey)]
    assert shown[1] < shown[0]


def test_a_search_ends_when_all_that_is_left_is_dark() -> None:
    # From so high the picture shows all of the area; the far half of it is dark.
    high = Camera(eye=(1.0, -0.5, 5.0), target=(1.0, -0.5, 0.0), up=(1.0, 0.0, 0.0), field_of_view=60.0)
    dark = Top(1.0, -3.0, 0.001, (9.0, 2.5), (20, 20, 20))
    given = {**WANTED, **SURVEY, "base_position": (-9.0, 0.0, 0.31)}
    for shade, is_absent in ((dark, False), (dark._replace(colour=(150, 150, 150)), True)):
        watched = Watched("fetch_object", "find_object", given)
        found = watched.see(0.0, draw(high, [shade], name="mast"))
        assert (found["object_absent"], found["search_darkened"]) == (is_absent, not is_absent)
        if shade is dark:
            assert found["object_dark_place"][1] < -0.5
            assert 0.2 < found["object_searched"] < 0.8
        else:
            assert found["object_dark_place"] is None
    lit = watched.see(1.0, draw(high, [], name="mast", time=1.0))
    assert (lit["object_absent"], lit["search_darkened"], lit["object_dark_place"]) == (True, False, None)


@pytest.mark.parametrize(("shade", "is_seen"), [((25, 25, 25), False), ((90, 90, 90), True)])
def test_an_object_that_is_half_in_the_dark_is_not_located(
    shade: tuple[int, int, int], is_seen: bool
) -> None:
    over = Top(0.6, 0.29, 0.081, (0.05, 0.09), shade)
    found = from_mast(STANDING, over)
    assert (found["object_seen"], found["search_darkened"]) == (is_seen, not is_seen)
    if not is_seen:
        assert found["object_dark_place"] == pytest.approx((0.6, 0.19, 0.08), abs=0.01)
        assert found["object_absent"] is False


@pytest.mark.parametrize(("radius", "scale"), [(0.0154, 0.7), (0.022, 1.0)])
def test_a_much_lower_object_is_a_small_one_only_if_its_top_is_small_too(radius: float, scale: float) -> None:
    low = STANDING._replace(z=0.056, half=(radius, 0.0))
    found = from_mast(low)
    assert found["object_position"][2] == pytest.approx(0.028 if scale < 1.0 else 0.016, abs=0.004)
    if scale < 1.0:
        assert found["object_scale"] == pytest.approx(scale, abs=0.05)


@pytest.mark.parametrize("x", [-0.45, -0.2])
def test_the_base_stands_beside_an_object_in_the_aisle(x: float) -> None:
    found = tracked(1.0, object_seen=True, object_seen_time=1.0, object_position=(x, 0.7, 0.0))
    u, v, _ = found["station_position"]
    assert u == -0.595
    assert dist((u, v), (x, 0.7)) == pytest.approx(0.58)
    assert (v > 0.7, found["object_out_of_reach"]) == (True, False)


def test_a_grip_that_is_denied_is_tried_turned_then_beside_the_middle_then_from_elsewhere() -> None:
    observed: dict[str, Any] = {
        "tool_position": (0.3, 0.0, 0.5),
        "base_position": (0.0, 2.0, 0.0),
        "object_position": (0.5, 2.0, 0.1),
        "object_yaw": 0.0,
        "object_free": True,
        "object_grip_height": 0.012,
        "object_free_across": True,
        "object_lying": False,
        "holding": False,
    }
    body = runpy.run_module("ecms.fetch_object.skills")["grasp"](observed, {"hand_speed": 0.45})
    yaws, stations = list[float](), list[tuple[float, float]]()
    action = next(body)
    with suppress(ActionDenied):
        while len(yaws) < 30:
            if action.kind == "move_base":
                stations.append((action.parameters["x"], action.parameters["y"]))
            low = action.kind == "move_tool" and action.parameters["target"][2] < 0.3
            if low:
                yaws.append(action.parameters["yaw"])
            action = body.throw(ActionDenied("too near", observed)) if low else body.send(observed)
    grips = [0.0, *[pi / 2.0] * 3, 0.0, 0.0]
    assert yaws == pytest.approx([*grips * 3, pi, -pi / 2.0])
    assert [y for _, y in stations] == pytest.approx([2.4, 1.6])
    assert all(dist((x, y), (0.5, 2.0)) <= 0.62 for x, y in stations)


def test_a_place_that_is_too_old_by_the_turn_of_a_grip_is_looked_at_again() -> None:
    skills = runpy.run_module("ecms.fetch_object.skills")
    observed = {"tool_position": (0.3, 0.0, 0.5), "base_position": (0.0, 0.0, 0.0), "holding": False}
    body = skills["_grip"](observed, 0.45, 0.0)
    asked = [next(body), body.send(observed)]
    assert asked[-1].parameters == {"camera": "mast"}
    with pytest.raises(StopIteration):
        body.send(observed)


@pytest.mark.parametrize(("x", "along"), [(-0.45, -0.145), (-0.76, 0.165), (-1.2, -0.58)])
def test_beside_what_lies_in_the_west_of_the_aisle_the_base_stands_where_the_floor_ends(
    x: float, along: float
) -> None:
    u, v = base_from(x, 0.0)
    assert u == pytest.approx(along)
    assert hypot(u, v) == pytest.approx(0.58)


@pytest.mark.parametrize(
    ("y", "z", "is_out"), [(0.62, -0.26, True), (0.64, -0.26, False), (0.62, 0.14, False)]
)
def test_on_the_floor_at_the_benches_an_object_is_out_of_reach(y: float, z: float, is_out: bool) -> None:
    given = {"object_position": (0.3, y, z), "object_seen": True, "object_seen_time": 1.0}
    assert tracked(1.0, base_position=(-0.28, y, 0.0), **given)["object_out_of_reach"] is is_out


def test_places_that_were_looked_over_before_the_object_was_missed_do_not_count() -> None:
    watched = Watched("fetch_object", "find_object", {**WANTED, **SURVEY, "base_position": (0.0, 0.2, 0.3)})
    before = watched.see(0.0, draw(ABOVE, [], name="aisle_top"))["object_searched"]
    missed = watched.see(1.0, draw(ABOVE, [], name="mast", time=1.0))["object_searched"]
    after = watched.see(2.0, draw(ABOVE, [], name="mast", time=2.0))["object_searched"]
    assert before > 0.0
    assert missed == after > 0.0


@pytest.mark.parametrize("start_at", [0.0, -0.05])
@pytest.mark.parametrize(("gap", "fits"), [(0.10, True), (0.04, True), (0.025, True), (0.005, False)])
def test_things_of_a_kind_that_are_one_part_of_a_picture_are_separated_by_their_places(
    gap: float, fits: bool, start_at: float
) -> None:
    points = np.zeros((40, 40, 3))
    points[:, :, 1] = np.linspace(0.0, 0.04, 40)
    points[:20, :, 0], points[20:, :, 0] = (
        np.linspace(start, start + 0.04, 20)[:, None] for start in (start_at, start_at + 0.04 + gap)
    )
    part, larger = parts_of(np.ones((40, 40), np.bool_), points, 0.045)
    assert bool(part is not None and int(part.sum()) == 800) is fits
    assert larger.all() if not fits else not larger.any()


def test_a_thing_of_its_colour_that_is_larger_is_no_proof_that_it_is_not_there() -> None:
    larger = STANDING._replace(half=(0.06, 0.06), is_round=False)
    search = Search({}, {}, {})
    stands = np.array([[0.0, 0.2], [0.1, 0.3]])
    points = np.stack(np.meshgrid(np.arange(-2, 2, 0.04), np.arange(-2, 2, 0.04), [0.0]), axis=-1).reshape(
        -1, 3
    )
    lit = np.ones(len(points), np.bool_)
    empty = search.look_at(0.0, points, lit, stands, None)
    assert (empty["object_absent"].value, empty["object_unlike"].value) == (True, False)
    red = np.array([[0.0, 0.2, 0.1]])
    shown = search.look_at(1.0, points, lit, stands, None, unlike=red)
    assert (shown["object_absent"].value, shown["object_unlike"].value) == (False, True)
    assert shown["object_unlike_place"].value == pytest.approx((0.0, 0.2, 0.1))
    assert (search.count_elsewhere(red, stands), search.count_elsewhere(red + 0.5, stands)) == (0, 1)
    # A later picture shows something else there.
    gone = search.look_at(2.0, points, lit, stands, None, unlike=red[:0])
    assert (gone["object_absent"].value, gone["object_unlike"].value) == (True, False)
    # One outside of the searched area stands for no square of it.
    outside = np.stack(np.meshgrid(np.arange(0.4, 0.6, 0.02), np.arange(-0.3, 0.7, 0.02), [0.0]), axis=-1)
    search = Search({}, {}, {})
    partly = search.look_at(0.0, points, points[:, 1] > 0.0, stands, None, unlike=outside.reshape(-1, 3))
    assert (partly["object_absent"].value, partly["object_unlike"].value) == (False, False)
    found = from_mast(larger)
    assert (found["object_seen"], found["object_absent"]) == (False, False)
    assert found["object_unlike_place"] == pytest.approx((0.6, 0.2, 0.08), abs=0.1)


@pytest.mark.parametrize(
    ("gap_after", "height_after", "times"),
    [(0.010, 0.25, 1), (0.080, 0.25, 0), (0.044, 0.26, 0)],
)
def test_an_object_that_leaves_closed_fingers_as_they_rise_has_slipped(
    gap_after: float, height_after: float, times: int
) -> None:
    watched = Watched("fetch_object", "track", {**WANTED, **SURVEY})
    base = {"holding": True, "finger_gap": 0.044, "base_position": (0.0, 0.2, 0.0)}
    watched.readings |= {**base, "tool_position": (0.6, 0.2, 0.15)}
    assert watched.see(0.0)["object_slips"] == 0
    watched.readings |= {"finger_gap": gap_after, "holding": gap_after == 0.044}
    watched.readings |= {"tool_position": (0.6, 0.2, height_after)}
    found = watched.see(1.0)
    assert (found["object_slips"], found["object_slips_out"]) == (times, False)


@pytest.mark.parametrize(("rise", "times"), [(0.02, 1), (0.20, 0)])
def test_fingers_on_their_way_count_as_a_slip_once_they_are_shut_unless_it_was_lifted(
    rise: float, times: int
) -> None:
    watched = Watched("fetch_object", "track", {**WANTED, **SURVEY})
    watched.readings |= {"base_position": (0.0, 0.2, 0.0)}
    found: dict[str, Any] = {}
    for time, (height, gap) in enumerate([(0.0, 0.044), (rise, 0.044), (rise, 0.030), (rise, 0.010)]):
        watched.readings |= {"holding": gap == 0.044, "finger_gap": gap}
        watched.readings |= {"tool_position": (0.6, 0.2, 0.15 + height)}
        found = watched.see(float(time))
    assert found["object_slips"] == times


def test_two_slips_in_a_row_are_more_than_chance_and_those_of_another_object_do_not_count() -> None:
    watched = Watched("fetch_object", "track", {**WANTED, **SURVEY})
    watched.readings |= {"base_position": (0.0, 0.2, 0.0), "tool_position": (0.6, 0.2, 0.15)}
    for time in range(4):
        is_held = time % 2 == 0
        watched.readings |= {"holding": is_held, "finger_gap": 0.044 if is_held else 0.010}
        found = watched.see(float(time))
    assert (found["object_slips"], found["object_slips_out"]) == (2, True)
    watched.readings |= {"object": "blue_block"}
    assert watched.see(4.0)["object_slips_out"] is False

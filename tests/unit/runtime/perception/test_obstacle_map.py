"""The map of obstacles: names, what explains them, and when they are gone; pictures are drawn here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from aeros.perception.obstacles import DepthPicture, SpaceBox
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.obstacle_map import ObstacleMap
from aeros.runtime.perception.posture_log import PostureLog
from aeros.runtime.ports import Ball, CameraPicture, CameraView, Obstacle, Reading, RobotBody
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.motion import MotionPolicy
from tests.unit.perception.test_obstacles import CUBE, EYE, FIELD, SIZE, TARGET, UP, seen
from tests.unit.runtime.perception.kettle import kettle, site

BODY = RobotBody(((0.0, 0.0, 0.0),) * 7, (0.0, 0.0, 0.1), (Ball("arm", 0, (0.5, 0.1, 0.3), 0.2),))
"""A robot whose foot alone has an extent: a ball that stays where it is."""

NO_BODY = replace(BODY, balls=())
FAR = {"holding": Reading(False, 0.0)}
JOINTS = (0.0,) * 7


def motion() -> MotionPolicy:
    found = site().motion
    assert found is not None
    return found


def configured(occupies: AxisAlignedBox | None = None) -> Configuration:
    """The reference site with a module, whose first variable has a space around it."""
    ecm = kettle()
    name, declared = next(iter(ecm.state.items()))
    state = {**ecm.state, name: replace(declared, occupies=occupies)}
    return Configuration(site(), {ecm.id: replace(ecm, state=state)}, {}, "c" * 64)


def taken(picture: DepthPicture, time: float, camera: str = "overhead") -> CameraPicture:
    pixels = SIZE[0] * SIZE[1]
    depth = picture.depth.astype(np.float32).tobytes()
    return CameraPicture(camera, time, *SIZE, bytes(3 * pixels), depth, CameraView(EYE, TARGET, UP, FIELD))


class Map:
    """A map that looks at pictures of one camera."""

    def __init__(self, body: RobotBody = NO_BODY, configuration: Configuration | None = None) -> None:
        self.postures = PostureLog()
        self.map, self.body = ObstacleMap(self.postures), body
        self.configuration = configuration or configured()
        self.time = 0.0

    def look(
        self, picture: DepthPicture, camera: str = "overhead", readings: Mapping[str, Any] | None = None
    ) -> list[Obstacle]:
        self.time += 1.0
        self.postures.note(motion(), self.time, {"joint_position": JOINTS, "base_position": (0.0, 0.0, 0.0)})
        pictures = {camera: taken(picture, self.time, camera)}
        self.map.look(self.configuration, pictures, readings or FAR, self.body)
        return list(self.map.obstacles())


def test_an_unknown_thing_is_named_and_placed_and_keeps_its_name() -> None:
    one = Map()
    (found,) = one.look(seen(CUBE))
    assert (found.name, found.camera, found.volume, found.seen) == (
        "unknown-object-1",
        "overhead",
        "over_bench",
        1.0,
    )
    margin = 0.015
    assert found.lower == pytest.approx((0.45 - margin, 0.05 - margin, 0.0), abs=0.012)
    assert found.upper == pytest.approx((0.55 + margin, 0.15 + margin, 0.1 + margin), abs=0.012)
    (again,) = one.look(seen(CUBE, noise=0.002))
    assert again == found._replace(seen=2.0), "it stands still, whatever the noise"
    second = SpaceBox((0.6, -0.3, 0.0), (0.7, -0.2, 0.3))
    assert [each.name for each in one.look(seen(CUBE, second))] == ["unknown-object-1", "unknown-object-2"]


def test_a_moved_thing_is_where_it_is_seen_and_a_place_seen_free_has_none() -> None:
    one = Map()
    (found,) = one.look(seen(CUBE))
    shifted = SpaceBox((0.50, 0.05, 0.0), (0.60, 0.15, 0.1))
    (moved,) = one.look(seen(shifted))
    assert moved.name == found.name
    assert moved.lower[0] == pytest.approx(0.485, abs=0.012)
    assert one.look(seen()) == []


def test_an_obstacle_is_lowered_to_the_height_that_a_picture_shows() -> None:
    half = Fraction(6, 100)
    one = Map(configuration=configured(AxisAlignedBox((-half, -half, -half), (half, half, half))))
    name = next(iter(one.configuration.modules["kettle"].state))
    carried = SpaceBox((0.45, 0.05, 0.2), (0.55, 0.15, 0.3))
    (found,) = one.look(seen(carried))
    assert found.upper[2] == pytest.approx(0.315, abs=0.012)
    known = {**FAR, name: Reading((0.5, 0.1, 0.05), 0.5)}
    # Beside it stands an unknown thing: the measured one explains what it is, the space above it is free.
    assert one.look(seen(CUBE), readings=known) == []
    (found,) = one.look(seen(carried))
    tall = SpaceBox((0.45, 0.05, 0.0), (0.47, 0.15, 0.2))
    (left,) = one.look(seen(CUBE, tall), readings=known)
    assert 0.2 <= left.upper[2] <= 0.25


def test_a_hidden_thing_stays() -> None:
    one = Map()
    (found,) = one.look(seen(CUBE))
    hand = SpaceBox((0.40, 0.0, 0.6), (0.62, 0.2, 0.8))
    one.body = replace(NO_BODY, balls=(Ball("arm", 0, (0.5, 0.1, 0.7), 0.25),))
    assert one.look(seen(CUBE, hand)) == [found]


def test_the_robot_at_its_joints_and_a_held_object_are_no_obstacles() -> None:
    assert len(Map().look(seen(CUBE))) == 1
    assert Map(BODY).look(seen(CUBE)) == []
    held = SpaceBox((-0.05, -0.05, 0.05), (0.05, 0.05, 0.15))
    raised = SpaceBox((0.25, -0.05, 0.0), (0.30, 0.05, 0.12))
    tool = replace(NO_BODY, tool_offset=(0.28, 0.0, 0.08))
    assert len(Map(tool).look(seen(raised), readings={"holding": Reading(False, 0.0)})) == 1
    assert Map(tool).look(seen(raised), readings={"holding": Reading(True, 0.0)}) == []
    assert Map(tool).look(seen(raised), readings={"joint_position": Reading(JOINTS, 0.0)}) == [], held


def test_a_measured_object_explains_a_thing_of_its_size() -> None:
    half = Fraction(6, 100)
    space = AxisAlignedBox((-half, -half, -half), (half, half, half))
    one = Map(configuration=configured(space))
    name = next(iter(one.configuration.modules["kettle"].state))
    middle = {**FAR, name: Reading((0.5, 0.1, 0.05), 0.5)}
    assert len(one.look(seen(CUBE))) == 1
    assert one.look(seen(CUBE), readings=middle) == [], "measured later, it is no obstacle any more"
    assert len(one.look(seen(CUBE), readings={**FAR, name: Reading((0.5, 0.1, 0.05), -1e4)})) == 1, "too old"
    tall = SpaceBox(CUBE.lower, (0.55, 0.15, 0.4))
    assert len(one.look(seen(tall), readings=middle)) == 1, "it is larger than what is measured"


def test_pictures_without_depth_or_of_cameras_that_see_no_volume_are_not_looked_at() -> None:
    one = Map()
    assert one.look(seen(CUBE), "hand") == []
    assert one.look(seen(CUBE), "elsewhere") == []
    flat = replace(taken(seen(CUBE), 9.0), depth=None)
    one.map.look(one.configuration, {"overhead": flat}, FAR, NO_BODY)
    assert one.map.obstacles() == ()
    without = replace(one.configuration, site=replace(site(), motion=replace(motion(), obstacles=None)))
    one.map.look(without, {"overhead": taken(seen(CUBE), 10.0)}, FAR, NO_BODY)
    assert one.map.obstacles() == ()


def test_a_picture_is_looked_at_once() -> None:
    one = Map()
    (found,) = one.look(seen(CUBE))
    old = {"overhead": taken(seen(), found.seen)}
    one.map.look(one.configuration, old, FAR, NO_BODY)
    assert one.map.obstacles() == (found,)

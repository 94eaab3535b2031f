"""Places of cameras: a camera that was knocked is put where the picture of the carriage shows it."""

from __future__ import annotations

from dataclasses import replace
from math import radians
from typing import Any

import numpy as np
import pytest

from aeros.perception.obstacles import DepthPicture, SpaceBox
from aeros.perception.own_base import CameraShift, true_place
from aeros.runtime.perception.camera_places import CameraPlaces
from aeros.runtime.perception.posture_log import PostureLog
from aeros.runtime.ports import CameraPicture, CameraView
from tests.unit.perception.test_own_base import MAST, NOWHERE, ROOM, SIZE, picture, turned
from tests.unit.runtime.perception.test_obstacle_map import JOINTS, motion

KNOCKED = CameraShift(turned((1.0, 1.0, 2.0), radians(2.0)), np.array((0.01, 0.0, -0.01)))


class Setting:
    """Cameras of the reference site, one of which takes pictures."""

    def __init__(self) -> None:
        self.postures, self.events = PostureLog(), list[dict[str, Any]]()
        self.places = CameraPlaces(self.postures, lambda kind, details: self.events.append({kind: details}))
        self.time = 0.0

    def place(self, depth: DepthPicture) -> CameraView:
        """Return the place of a camera that has just taken a picture."""
        self.time += 1.0
        self.postures.note(motion(), self.time, {"joint_position": JOINTS, "base_position": (0.0, 0.0, 0.0)})
        pixels = bytes(3 * SIZE[0] * SIZE[1])
        taken = CameraPicture(
            "mast", self.time, *SIZE, pixels, depth.depth.astype(np.float32).tobytes(), CameraView(*depth[1:])
        )
        placed = self.places.place({"mast": taken}, motion())
        assert self.places.place({"mast": taken}, motion())["mast"] is placed["mast"], "it is found once"
        return placed["mast"].view


def test_a_camera_is_where_its_last_picture_of_the_carriage_shows_it() -> None:
    setting, declared = Setting(), CameraView(*MAST)
    assert setting.place(picture(MAST)) == declared
    assert setting.events == []
    found = setting.place(picture(MAST, KNOCKED))
    eye, target, up = true_place(picture(MAST), KNOCKED)
    assert found.eye == pytest.approx(eye, abs=0.005)
    assert found.target == pytest.approx(target, abs=0.008)
    assert found.up == pytest.approx(up, abs=0.005)
    hidden = picture(MAST, KNOCKED, (*ROOM, SpaceBox((0.0, 0.0, 0.3), (0.3, 0.4, 0.4))))
    assert setting.place(hidden) == found, "something hides the carriage"
    assert setting.place(picture(MAST, KNOCKED, noise=0.001)) == found, "it has not moved since"
    assert setting.place(picture(MAST, NOWHERE)) == declared, "somebody has put it back"
    assert [one["camera-moved"]["camera"] for one in setting.events] == ["mast", "mast"]
    assert setting.events[0]["camera-moved"]["turn"] == pytest.approx(radians(2.0), abs=0.003)
    assert setting.events[1]["camera-moved"]["turn"] == 0.0


def test_a_camera_stays_where_the_site_or_the_robot_says_nothing() -> None:
    knocked, policy = picture(MAST, KNOCKED), motion()
    assert policy.obstacles is not None
    depth = knocked.depth.astype(np.float32).tobytes()
    taken = CameraPicture("mast", 1.0, *SIZE, bytes(3 * SIZE[0] * SIZE[1]), depth, CameraView(*MAST))
    no_base = replace(policy, obstacles=replace(policy.obstacles, base=None))
    for one, of in ((taken, no_base), (taken, policy), (replace(taken, depth=None, time=2.0), policy)):
        setting = Setting()
        if one.depth is None:
            setting.postures.note(policy, 2.0, {"joint_position": JOINTS, "base_position": (0.0, 0.0, 0.0)})
        assert setting.places.place({"mast": one}, of) == {"mast": one}

"""A picture that shows nothing decides nothing: what no camera has seen is unknown, and not false."""

from __future__ import annotations

from typing import Final

import numpy as np
import pytest

from aeros.perception import Picture
from tests.modules.looking import Watched, as_picture
from tests.modules.unknown.test_unknown_values import OBSERVED, module
from tests.shipped_scenes import overhead

OF_THE_PICTURE: Final = {
    "object_seen",
    "sponge_seen",
}
"""Variables that say what the last picture shows, and nothing of the cell."""

OF_THE_ROBOT: Final = {
    "object_grasped",
    "object_detected",
    "object_fits",
    "object_absent",
    "object_unlike",
    "search_darkened",
    "robot_at_target",
    "overhead_off",
}
"""Variables of the hand, of the base, of the instruction, or of what the robot knows."""

READINGS: Final = {
    **OBSERVED,
    "objects": {"blue_block": {"shape": "box", "size": (0.04, 0.04, 0.05), "colour": (0.15, 0.3, 0.75)}},
    "finger_gap": 0.08,
    "memory": {},
}
"""Readings that need no camera."""


def covered(name: str, time: float) -> Picture:
    """A picture of a camera with something dark right before it."""
    camera = overhead("table")
    size = (camera.height, camera.width)
    return as_picture(camera, np.full((*size, 3), 40, np.uint8), np.full(size, 0.04), name, time)


@pytest.mark.parametrize(
    ("of", "name"),
    [
        ("clean_table", "see_table"),
        ("clean_table", "check_table"),
        ("clean_table", "see_floor"),
        ("fetch_object", "find_object"),
        ("make_dumplings", "see_dumpling"),
        ("inspect_table", "see_all"),
    ],
)
def test_a_covered_camera_decides_nothing(of: str, name: str) -> None:
    declared = module(f"ecms/{of}").perceivers[name]
    watched = Watched(of, name, dict(READINGS))
    cameras = [one.name for one in declared.pictures]
    for time in (1.0, 2.0, 20.0):
        answer = watched.see(time, *(covered(one, time) for one in cameras), samples={"press_force": (0.0,)})
    decided = {one for one, value in answer.items() if type(value) is bool}
    assert decided <= OF_THE_PICTURE | OF_THE_ROBOT

"""A camera's place from the top of the robot's own carriage; pictures are drawn here, with noise of depth."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, radians, sin

import numpy as np
import pytest
from numpy.typing import NDArray

from aeros.perception.obstacles import DepthPicture, SpaceBox
from aeros.perception.own_base import CameraShift, find_camera_shift, true_place
from aeros.perception.points import Vector3, point_cloud

CARRIAGE = SpaceBox((-0.25, -0.225, -0.3), (0.25, 0.225, 0.0))
FLOOR = SpaceBox((-3.0, -3.0, -0.4), (3.0, 3.0, -0.3))
FOOT = SpaceBox((-0.1, -0.1, 0.0), (0.08, 0.1, 0.15))
ARM = SpaceBox((0.0, -0.05, 0.3), (0.3, 0.05, 0.4))
BENCH = SpaceBox((0.3, -0.5, -0.3), (1.0, 0.5, 0.0))
ROOM = (CARRIAGE, FLOOR, FOOT, ARM, BENCH)

SIZE = (320, 240)
MAST = ((0.05, 0.2, 0.85), (0.58, 0.0, 0.12), (0.0, 0.0, 1.0), 60.0)
OVERHEAD = ((0.45, 0.01, 1.2), (0.45, 0.01, 0.0), (1.0, 0.0, 0.0), 33.0)
AT_THE_SIDE = ((0.9, -0.2, 0.16), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 40.0)
NOWHERE = CameraShift(np.eye(3), np.zeros(3))


def turned(axis: Sequence[float], angle: float) -> NDArray[np.float64]:
    """The turn about a direction: Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    across = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    turn: NDArray[np.float64] = np.eye(3) + sin(angle) * across + (1.0 - cos(angle)) * across @ across
    return turn


def picture(
    view: tuple[Vector3, Vector3, Vector3, float],
    shift: CameraShift = NOWHERE,
    boxes: Sequence[SpaceBox] = ROOM,
    noise: float = 0.002,
) -> DepthPicture:
    """The picture of a camera that is elsewhere by `shift`, and says that it is at `view`."""
    blank = DepthPicture(np.ones((SIZE[1], SIZE[0])), *view)
    eye, target, up = true_place(blank, shift)
    rays = point_cloud(blank.depth, eye, target, up, view[3]) - np.array(eye)
    depth = np.full(blank.depth.shape, 5.0)
    for box in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = ((np.array(corner) - np.array(eye)) / rays for corner in box)
        first, last = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
        depth = np.where((first < last) & (first > 0.0) & (first < depth), first, depth)
    return blank._replace(depth=depth + np.random.default_rng(1).normal(0.0, noise, depth.shape))


@pytest.mark.parametrize("view", [MAST, OVERHEAD])
def test_a_single_picture_shows_how_a_camera_is_turned_and_moved_in_all_six_ways(
    view: tuple[Vector3, Vector3, Vector3, float],
) -> None:
    shifts = [
        NOWHERE,
        CameraShift(turned((1.0, 0.0, 0.0), radians(1.0)), np.zeros(3)),
        CameraShift(turned((0.0, 1.0, 0.0), radians(-1.0)), np.array((0.0, 0.005, 0.0))),
        CameraShift(turned((0.0, 0.0, 1.0), radians(2.0)), np.array((0.01, -0.01, 0.005))),
        CameraShift(turned((1.0, 1.0, 2.0), radians(-2.4)), np.array((-0.01, 0.0, -0.011))),
    ]
    for shift in shifts:
        found = find_camera_shift(picture(view, shift), CARRIAGE)
        assert found is not None
        assert found.difference(shift) < 0.006, shift
        eye, target, up = true_place(picture(view), found)
        assert point_cloud(np.ones((3, 3)), eye, target, up, view[3]) == pytest.approx(
            point_cloud(np.ones((3, 3)), *true_place(picture(view), shift), view[3]), abs=0.006
        )


def test_a_picture_without_enough_of_the_edges_shows_no_place() -> None:
    away = SpaceBox((-2.25, -0.225, -0.3), (-1.75, 0.225, 0.0))
    sheet = SpaceBox((0.1, -0.3, 0.03), (0.4, 0.3, 0.04))
    sloping = CameraShift(turned((1.0, 0.0, 0.0), radians(6.0)), np.zeros(3))
    assert find_camera_shift(picture(OVERHEAD), away) is None, "it is not in the picture"
    assert find_camera_shift(picture(OVERHEAD, boxes=(*ROOM, sheet)), CARRIAGE) is None, "one edge is hidden"
    assert find_camera_shift(picture(OVERHEAD, noise=0.006), CARRIAGE) is None, "noise hides the edges"
    assert find_camera_shift(picture(OVERHEAD, sloping), CARRIAGE) is None, "the camera has fallen over"
    assert find_camera_shift(picture(AT_THE_SIDE), CARRIAGE) is None, "the view is grazing"

"""A level table in a picture shows how a camera is tilted, and how high the table is."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np
import pytest
from numpy.typing import NDArray

from aeros.perception.level_ground import believe_height, level_ground
from aeros.perception.points import point_cloud
from aeros.perception.view import Picture

EYE, TARGET, SIZE = (0.5, 0.0, 1.4), (0.5, 0.0, 0.0), (80, 60)


def turned(angle: float, axis: int) -> NDArray[np.float64]:
    """The turn by an angle (rad) about x or y."""
    c, s = cos(angle), sin(angle)
    return np.array(([1, 0, 0], [0, c, -s], [0, s, c]) if axis == 0 else ([c, 0, s], [0, 1, 0], [-s, 0, c]))


def picture(angle: float = 0.0, axis: int = 0, table: float = 0.0, noise: float = 0.0) -> Picture:
    """A level table with a box, in the picture of a camera that is turned from its surveyed pose."""
    turn = turned(angle, axis)
    ahead = turn @ np.array((0.0, 0.0, -1.0))
    up = turn @ np.array((1.0, 0.0, 0.0))
    width, height = SIZE
    unit = point_cloud(
        np.ones((height, width)), EYE, tuple(EYE + ahead), tuple(up), 36.0
    ) - np.array(EYE)  # fmt: skip
    depth = (table - EYE[2]) / unit[:, :, 2]
    depth[20:30, 20:30] -= 0.05
    depth += np.random.default_rng(0).normal(0.0, noise, depth.shape)
    rgb = np.zeros((height, width, 3), np.uint8)
    return Picture("top", 0.0, rgb, depth.astype(np.float32), EYE, TARGET, (1.0, 0.0, 0.0), 36.0, SIZE)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("degrees", [-1.0, 0.0, 2.0])
def test_a_tilted_camera_is_turned_back(degrees: float, axis: int) -> None:
    seen = picture(radians(degrees), axis, noise=0.002)
    true = picture(noise=0.0).points()
    level = level_ground(seen, np.ones((60, 80), bool), 0.006, 500)
    assert level is not None
    assert level.tilt == pytest.approx(abs(radians(degrees)), abs=1e-3)
    assert level.height == pytest.approx(0.0, abs=1e-3)
    assert level.rotation @ level.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
    # The same spot of the table: x and y by its direction from the true camera.
    ways = turned(radians(degrees), axis).T @ (level.points - np.array(EYE))[45, 60]
    assert np.linalg.norm(seen.points()[45, 60] - true[45, 60]) < 0.1
    assert ways[2] < 0.0
    assert float(np.ptp(level.above_ground[35:, :, 2])) < 0.02


def test_a_spot_of_the_table_is_where_it_is_once_the_camera_is_turned_back() -> None:
    """1 degree moves what a camera 1.4 m away shows by 24 mm."""
    seen = picture(radians(1.0), 0)
    level = level_ground(seen, np.ones((60, 80), bool), 0.006, 500)
    assert level is not None
    truth = turned(radians(1.0), 0) @ (seen.points() - np.array(EYE)).reshape(-1, 3).T
    off = level.points.reshape(-1, 3) - (truth.T + np.array(EYE))
    assert np.abs(off).max() < 1e-4
    assert np.abs(seen.points() - level.points).max() > 0.02


def test_the_height_of_a_table_is_seen() -> None:
    level = level_ground(picture(table=0.02, noise=0.002), np.ones((60, 80), bool), 0.006, 500)
    assert level is not None
    assert level.height == pytest.approx(0.02, abs=1e-3)
    assert level.above_ground[20:30, 20:30, 2] == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize(
    ("degrees", "near", "least"),
    [(0.0, False, 1), (0.0, True, 5000), (5.0, True, 500)],
    ids=["nothing", "too little", "too steep"],
)
def test_a_picture_without_level_ground_is_not_turned(degrees: float, near: bool, least: int) -> None:
    assert level_ground(picture(radians(degrees)), np.full((60, 80), near), 0.006, least) is None


@pytest.mark.parametrize(("seen", "believed"), [(0.01, 0.0), (-0.01, 0.0), (0.02, 0.02), (-0.02, -0.02)])
def test_a_small_difference_of_heights_is_the_cameras(seen: float, believed: float) -> None:
    assert believe_height(seen, 0.0, 0.012) == believed

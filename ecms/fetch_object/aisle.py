"""Perceiver of the aisle: from how far aside the base can put the object down, past what stands there.

All lengths in metres, in the world frame.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from aeros.perception import Perception, Picture, Points, View, estimate

from .stations import base_for_delivery

ASIDES = (0.0, -0.10, 0.10, -0.17, 0.17, -0.25, 0.25, -0.31, 0.31, -0.38, 0.38, -0.44, 0.44)
"""Distances to the left of that at which the base may stand, in the order of trial, m."""

FLOOR_DEPTH = 0.30
"""Depth of the floor below the arm's base, m."""

OBSTACLE_HEIGHTS = (0.06, 0.27)
"""Heights over the floor of points of what stands there, m: 70 to 240 mm, with noise and half a degree of a
camera's heading. What is higher is seen by scanners."""

AISLE_EDGE = 0.27
"""Greatest x of what stands in the aisle, m: stands and benches along it begin at 0.30."""

CARRIAGE_HALF = (0.25, 0.225)
"""Half of the carriage's length along x and width along y, m."""

ROOM = 0.08
"""Distance that the carriage keeps, m: 15 mm from obstacles, whose margin is 15 mm, 30 mm to turn off, and
20 mm of noise."""

OWN = 0.05
"""Distance from the carriage within which points are its own, m: a camera is off by half a degree."""

IN_THE_WAY = 4
"""Number of points from which something is in the way: fewer are noise."""


def find_room(view: View) -> Perception:
    """Say how far to the left of the place of delivery the base stands, by the newest picture."""
    values: dict[str, Any] = {}
    newest = -1.0
    while True:
        given, picture = view.readings, view.pictures.get("aisle_top")
        if (
            picture is not None
            and picture.time > newest
            and "object_place" in given
            and "base_position" in given
        ):
            newest = picture.time
            aside = _aside(_standing_points(picture, given), given["object_place"])
            values = {"delivery_aside": estimate(aside, 0.001, time=picture.time)}
        view = yield dict(values)


def _standing_points(picture: Picture, given: Mapping[str, Any]) -> Points:
    """Return the points (n, 2) of what stands on the floor and is not the carriage."""
    points = picture.points().reshape(-1, 3)
    x, y, z = given["base_position"]
    heights = points[:, 2] - (z - FLOOR_DEPTH)
    low, high = OBSTACLE_HEIGHTS
    is_own = (np.abs(points[:, 0] - x) < CARRIAGE_HALF[0] + OWN) & (
        np.abs(points[:, 1] - y) < CARRIAGE_HALF[1] + OWN
    )
    is_standing = (heights > low) & (heights < high) & (points[:, 0] < AISLE_EDGE) & ~is_own
    standing: Points = points[is_standing][:, :2]
    return standing


def _aside(points: Points, place: tuple[float, float, float]) -> float:
    """Return the first way to stand aside at which the carriage has room; 0 if it has room at none."""
    for aside in ASIDES:
        u, v = base_for_delivery(place, aside)
        inside = (np.abs(points[:, 0] - u) < CARRIAGE_HALF[0] + ROOM) & (
            np.abs(points[:, 1] - v) < CARRIAGE_HALF[1] + ROOM
        )
        if np.count_nonzero(inside) < IN_THE_WAY:
            return aside
    return 0.0

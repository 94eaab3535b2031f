"""Obstacles in depth pictures that are drawn here: boxes over a table, seen from above."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from aeros.perception.obstacles import (
    DepthPicture,
    KnownThings,
    SpaceBox,
    WatchedSpace,
    depth_picture,
    find_obstacles,
    share_seen_free,
)

EYE, TARGET, UP, FIELD = (0.5, 0.0, 1.2), (0.5, 0.0, 0.0), (1.0, 0.0, 0.0), 40.0
SIZE = (160, 120)
TABLE = WatchedSpace(SpaceBox((0.2, -0.4, 0.0), (0.9, 0.4, 1.0)), 0.0, 0.07)
NOTHING = KnownThings((), (), (), 0.03)
CUBE = SpaceBox((0.45, 0.05, 0.0), (0.55, 0.15, 0.1))
PIXEL = 0.008


def seen(*boxes: SpaceBox, table: float = 0.0, noise: float = 0.0, tilt: float = 0.0) -> DepthPicture:
    """Draw boxes on a table; `tilt` (rad) turns the camera from where it is believed to be."""
    width, height = SIZE
    half = np.tan(np.radians(FIELD) / 2.0)
    across = (2.0 * np.arange(width) / width - 1.0) * half * width / height
    along = (1.0 - 2.0 * (np.arange(height) + 1.0) / height) * half
    # Straight down: up in the picture is x, right is -y.
    rays = np.zeros((height, width, 3))
    rays[:, :, 0], rays[:, :, 1], rays[:, :, 2] = along[:, None], -across[None, :], -1.0
    rays[:, :, 0] += tilt
    depth = np.full((height, width), np.inf)
    flat = SpaceBox((-9.0, -9.0, table - 1.0), (9.0, 9.0, table))
    for box in (flat, *boxes):
        with np.errstate(divide="ignore", invalid="ignore"):
            low = (np.array(box.lower) - EYE) / rays
            high = (np.array(box.upper) - EYE) / rays
        enter, leave = np.fmin(low, high).max(axis=2), np.fmax(low, high).min(axis=2)
        depth = np.where(enter <= leave, np.minimum(depth, enter), depth)
    depth += np.random.default_rng(3).normal(0.0, noise, depth.shape) if noise else 0.0
    return DepthPicture(depth, EYE, TARGET, UP, FIELD)


def corners(box: SpaceBox) -> NDArray[np.float64]:
    return np.array((*box.lower, *box.upper))


def test_an_unknown_box_is_found_down_to_the_table() -> None:
    (found,) = find_obstacles(seen(CUBE, noise=0.002), [TABLE], NOTHING)
    assert corners(found) == pytest.approx(corners(CUBE), abs=PIXEL + 0.008)


def test_an_empty_table_shows_nothing() -> None:
    assert find_obstacles(seen(noise=0.003), [TABLE], NOTHING) == []


@pytest.mark.parametrize(("table", "tilt"), [(0.02, 0.0), (-0.02, 0.0), (0.0, 0.0175)])
def test_neither_a_table_at_another_height_nor_a_turned_camera_is_an_obstacle(
    table: float, tilt: float
) -> None:
    assert find_obstacles(seen(table=table, tilt=tilt, noise=0.002), [TABLE], NOTHING) == []
    raised = SpaceBox(CUBE.lower, (*CUBE.upper[:2], 0.1 + table))
    assert len(find_obstacles(seen(raised, table=table, tilt=tilt, noise=0.002), [TABLE], NOTHING)) == 1


def test_low_and_tiny_things_and_those_outside_are_left_out() -> None:
    low = SpaceBox(CUBE.lower, (0.55, 0.15, 0.06))
    tiny = SpaceBox((0.50, 0.10, 0.0), (0.51, 0.11, 0.3))
    outside = SpaceBox((0.45, 0.42, 0.0), (0.55, 0.47, 0.2))
    assert find_obstacles(seen(low, tiny, outside), [TABLE], NOTHING) == []


def test_things_higher_than_the_bound_are_left_to_other_sensors() -> None:
    person = SpaceBox((0.6, -0.3, 0.0), (0.7, -0.2, 0.3))
    bounded = TABLE._replace(greatest_height=0.2)
    assert len(find_obstacles(seen(CUBE, person), [TABLE], NOTHING)) == 2
    (found,) = find_obstacles(seen(CUBE, person), [bounded], NOTHING)
    assert found.upper[2] == pytest.approx(0.1, abs=0.01)


def test_two_things_are_two_obstacles() -> None:
    other = SpaceBox((0.6, -0.3, 0.0), (0.7, -0.2, 0.3))
    assert len(find_obstacles(seen(CUBE, other), [TABLE], NOTHING)) == 2
    # The nearer one hides part of the table, and not that there is a depth step between both.
    behind = SpaceBox((0.45, -0.02, 0.0), (0.55, 0.04, 0.4))
    assert len(find_obstacles(seen(CUBE, behind), [TABLE], NOTHING)) == 2


def test_known_objects_and_the_robot_are_no_obstacles() -> None:
    picture = seen(CUBE)
    assert find_obstacles(picture, [TABLE], NOTHING._replace(objects=[CUBE])) == []
    assert find_obstacles(picture, [TABLE], NOTHING._replace(own=[CUBE])) == []
    assert find_obstacles(picture, [TABLE], NOTHING._replace(balls=[((0.5, 0.1, 0.05), 0.1)])) == []


def test_the_space_of_a_known_object_hides_no_part_of_a_neighbour() -> None:
    tall = SpaceBox((0.45, 0.05, 0.0), (0.55, 0.15, 0.3))
    half = SpaceBox((0.40, 0.10, 0.0), (0.60, 0.30, 0.35))
    (found,) = find_obstacles(seen(tall), [TABLE], NOTHING._replace(objects=[half]))
    assert corners(found) == pytest.approx(corners(tall), abs=2.0 * PIXEL)


def test_a_place_is_seen_free_only_where_something_behind_it_is_seen() -> None:
    assert share_seen_free(seen(), CUBE) == (1.0, 1.0)
    shown, free = share_seen_free(seen(CUBE), CUBE)
    assert shown == 1.0
    assert free < 0.3
    hidden = SpaceBox((0.4, 0.0, 0.6), (0.6, 0.2, 0.8))
    assert share_seen_free(seen(CUBE, hidden), CUBE) == (0.0, 0.0)
    assert share_seen_free(seen(), SpaceBox((2.0, 2.0, 0.0), (2.1, 2.1, 0.1))) == (0.0, 0.0)
    assert share_seen_free(seen(), SpaceBox((0.4, 0.0, 1.3), (0.6, 0.2, 1.4))) == (0.0, 0.0)


def test_a_depth_picture_is_read_row_by_row() -> None:
    depth = np.arange(6, dtype=np.float32).reshape(2, 3)
    picture = depth_picture(depth.tobytes(), (3, 2), (EYE, TARGET, UP, FIELD))
    assert picture.depth.tolist() == depth.tolist()
    assert picture.field_of_view == FIELD


def test_boxes_are_grown_joined_and_compared() -> None:
    box = SpaceBox((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    assert box.grown(0.5) == SpaceBox((-0.5, -0.5, -0.5), (1.5, 1.5, 1.5))
    assert box.meets(SpaceBox((1.0, 0.0, 0.0), (2.0, 1.0, 1.0)))
    assert not box.meets(SpaceBox((1.1, 0.0, 0.0), (2.0, 1.0, 1.0)))
    assert box.joined(SpaceBox((2.0, -1.0, 0.5), (3.0, 0.5, 0.6))) == SpaceBox(
        (0.0, -1.0, 0.0), (3.0, 1.0, 1.0)
    )

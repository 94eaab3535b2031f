"""Annotations of pictures: where the camera's own geometry says that a point is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.perception.points import point_cloud
from aeros.runtime.bus.viewer.picture_annotations import annotate, project
from aeros.runtime.bus.viewer.things import SceneThing
from aeros.runtime.ports import CameraPicture, CameraView
from tests.hypothesis_profiles import examples

VIEW = CameraView((0.2, -0.1, 1.5), (0.3, 0.4, 0.1), (0.0, 0.3, 1.0), 50.0)
SIZE = (32, 24)
PICTURE = CameraPicture("top", 2.5, *SIZE, bytes(3 * 32 * 24), None, VIEW)


def thing(label: str, box: bool = False) -> SceneThing:
    half = 0.05
    sides = ((-half, -half, -half), (half, half, half))
    return SceneThing(f"m.{label}_position", label, "m.look", 1.0, sides if box else None)


@examples(20)
@given(st.integers(0, 23), st.integers(0, 31), st.floats(0.1, 5.0))
def test_a_point_is_where_perceivers_found_it(row: int, column: int, depth: float) -> None:
    points = point_cloud(np.full((24, 32), depth), *VIEW)
    x, y, z = points[row, column].tolist()
    at = project(VIEW, SIZE, (x, y, z))
    assert at is not None
    # A pixel shows what the ray through its lower left corner meets.
    assert (at.x, at.y) == pytest.approx((column, row + 1), abs=1e-9)


def test_each_thing_in_the_picture_has_a_circle_and_its_name() -> None:
    found = annotate(PICTURE, [(thing("cube", box=True), VIEW.target), (thing("far"), (9.0, 9.0, 0.0))])
    (circle,), (lines,), (text,) = found.circles, found.points, found.texts
    assert (circle.position.x, circle.position.y) == pytest.approx((16.0, 12.0))
    assert (circle.timestamp.sec, circle.timestamp.nanosec) == (2, 500_000_000)
    assert text.text == "cube"
    assert len(lines.points) == 24  # both ends of 12 edges
    assert lines.type == 4


def test_a_point_behind_the_camera_is_not_drawn() -> None:
    behind = tuple(2.0 * eye - target for eye, target in zip(VIEW.eye, VIEW.target, strict=True))
    assert project(VIEW, SIZE, (behind[0], behind[1], behind[2])) is None
    found = annotate(PICTURE, [(thing("cube"), (behind[0], behind[1], behind[2]))])
    assert not any((found.circles, found.points, found.texts))

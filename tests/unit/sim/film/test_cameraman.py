"""The camera holds the arm and whoever comes near, and never jumps."""

from __future__ import annotations

from itertools import pairwise
from math import cos, dist, hypot, radians

import pytest

from aeros.sim.film.cameraman import CameraMode, plan_cameras
from aeros.sim.geometry import Camera, Vector3, camera_axes, subtract
from tests.unit.sim.film.recordings import recording


def is_seen(camera: Camera, point: Vector3) -> bool:
    """True if a point is in the picture, which is as wide as it is high times 16 / 9."""
    right, up, ahead = camera_axes(camera)
    away = subtract(point, camera.eye)
    x, y, z = (sum(a * b for a, b in zip(axis, away, strict=True)) for axis in (right, up, ahead))
    half = z * (1.0 / cos(radians(camera.field_of_view / 2)) ** 2 - 1.0) ** 0.5
    return z > 0 and abs(y) < half and abs(x) < half * camera.width / camera.height


@pytest.mark.parametrize("mode", ["orbit", "fixed"])
def test_arm_and_person_are_in_every_picture(mode: CameraMode) -> None:
    whole = recording(31)
    cameras = plan_cameras(whole, whole.samples, mode, (1280, 720), 30)
    for camera, sample in zip(cameras, whole.samples, strict=True):
        person = sample.people[0]
        assert all(is_seen(camera, (x, y, z)) for x in (-0.2, 0.6) for y in (-0.3, 0.3) for z in (0.0, 0.8))
        if hypot(person.x, person.y) < 2.4:
            assert is_seen(camera, (person.x, person.y, person.floor + person.height))
    steps = [dist(a.eye, b.eye) for a, b in pairwise(cameras)]
    assert max(steps) < 0.1
    assert (max(steps) == 0.0) is (mode == "fixed")


def test_a_single_picture_has_a_camera() -> None:
    whole = recording(1)
    (camera,) = plan_cameras(whole, whole.samples, "orbit", (640, 360), 15)
    assert is_seen(camera, (0.3, 0.0, 0.3))

"""Cameras of a scene, seen from W."""

from __future__ import annotations

from math import pi

import pytest

from aeros.sim.geometry import Camera, Vector3
from aeros.sim.layouts.cameras import camera_in_world, fixed_camera
from tests.shipped_scenes import shipped_scene


def camera_at(name: str, base: Vector3, tool: Vector3, yaw: float) -> Camera:
    return camera_in_world(shipped_scene("fetch").cameras[name], base, tool, yaw)


def test_the_cameras_move_with_the_robot() -> None:
    mast = camera_at("mast", (1.0, 2.0, 0.3), (0.0, 0.0, 0.0), 0.0)
    assert mast.eye == pytest.approx((1.05, 2.2, 1.15))
    assert mast.target == pytest.approx((1.58, 2.0, 0.42))
    hand = camera_at("hand", (0.0, 0.0, 0.0), (1.0, 2.0, 0.5), pi / 2)
    assert hand.eye == pytest.approx((1.0, 2.07, 0.56))
    assert hand.target == pytest.approx((1.0, 2.07, -0.44))
    assert hand.up == pytest.approx((0.0, 1.0, 0.0))
    straight = camera_at("hand", (0.0, 0.0, 0.0), (1.0, 2.0, 0.5), 0.0)
    assert straight.eye == pytest.approx((1.07, 2.0, 0.56))
    assert straight.up == pytest.approx((1.0, 0.0, 0.0))


def test_a_fixed_camera_is_as_declared() -> None:
    camera = fixed_camera(shipped_scene("dumpling_bench").cameras["side"])
    assert camera.eye == pytest.approx((0.80, -0.22, 0.16))
    assert camera.target == pytest.approx((0.52, 0.0, 0.095))
    assert camera.up == pytest.approx((0.0, 0.0, 1.0))
    assert camera.field_of_view == pytest.approx(18.0)
    assert (camera.width, camera.height) == (160, 120)

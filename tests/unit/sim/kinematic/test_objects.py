from __future__ import annotations

from math import cos, pi, sin

import pytest

from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.kinematic.objects import CylindricalObject, GraspableObject


def test_a_box_turned_in_the_fingers_is_wider_and_a_round_thing_is_not() -> None:
    tool = Pose((0.0, 0.0, 0.0), yaw_orientation(0.0))
    corners = (-0.03, -0.02, -0.02), (0.03, 0.02, 0.02)
    assert GraspableObject(tool, *corners, 0.02).width_between(tool) == pytest.approx(0.04)
    for yaw in (0.3, -0.3, pi / 2):
        box = GraspableObject(Pose((0.0, 0.0, 0.0), yaw_orientation(yaw)), *corners, 0.02)
        assert box.width_between(tool) == pytest.approx(0.04 * cos(yaw) + 0.06 * abs(sin(yaw)))
        can = CylindricalObject(
            Pose((0.0, 0.0, 0.0), yaw_orientation(yaw)), (-0.02, -0.02, -0.02), (0.02, 0.02, 0.02), 0.02
        )
        assert can.width_between(tool) == pytest.approx(0.04)

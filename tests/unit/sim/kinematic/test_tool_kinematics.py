from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.kinematics import forward_kinematics
from tests.unit.sim.robot.panda import PANDA, Q_MAX, Q_MIN


def test_the_chain_of_one_posture_is_the_chain_of_many() -> None:
    postures = Q_MIN + np.random.default_rng(5).uniform(size=(50, 7)) * (Q_MAX - Q_MIN)
    places, rotations, jacobians = forward_kinematics(PANDA, postures)
    for q, place, rotation, jacobian in zip(postures, places, rotations, jacobians, strict=True):
        found = tool_kinematics(PANDA, q.tolist())
        assert found.position == pytest.approx(place, abs=1e-12)
        assert pytest.approx(jacobian[:3], abs=1e-12) == np.array(found.jacobian).T
        turn = np.arctan2(rotation[1, 0], rotation[0, 0])
        assert (cos(found.yaw), sin(found.yaw)) == pytest.approx((cos(turn), sin(turn)), abs=1e-12)


def test_the_jacobian_is_the_derivative_of_the_position() -> None:
    q = [0.1, -0.4, 0.2, -1.9, 0.3, 1.7, 0.5]
    found = tool_kinematics(PANDA, q)
    assert len(found.jacobian) == 7
    for joint in range(7):
        ends = []
        for step in (-1e-6, 1e-6):
            moved = list(q)
            moved[joint] += step
            ends.append(tool_kinematics(PANDA, moved).position)
        slope = [(b - a) / 2e-6 for a, b in zip(*ends, strict=True)]
        assert found.jacobian[joint] == pytest.approx(slope, abs=1e-8)


def test_joint_1_turns_the_tool_about_the_upright_axis() -> None:
    q = [0.0, -0.4, 0.0, -1.9, 0.0, 1.5, pi / 4]
    before, after = tool_kinematics(PANDA, q), tool_kinematics(PANDA, [0.5, *q[1:]])
    x, y, z = before.position
    assert y == pytest.approx(0.0, abs=1e-12)
    assert after.position == pytest.approx((x * cos(0.5), x * sin(0.5), z))
    assert after.yaw - before.yaw == pytest.approx(0.5)
    assert before.yaw == pytest.approx(0.0, abs=1e-12)

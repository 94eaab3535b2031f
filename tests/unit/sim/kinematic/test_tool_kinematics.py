from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.limits import Q_MAX, Q_MIN


def test_the_chain_of_one_posture_is_the_chain_of_many() -> None:
    postures = Q_MIN + np.random.default_rng(5).uniform(size=(50, 7)) * (Q_MAX - Q_MIN)
    places, rotations, jacobians = forward_kinematics(postures)
    for q, place, rotation, jacobian in zip(postures, places, rotations, jacobians, strict=True):
        found = tool_kinematics(q.tolist())
        assert found.position == pytest.approx(place, abs=1e-12)
        assert pytest.approx(jacobian[:3], abs=1e-12) == np.array(found.jacobian).T
        turn = np.arctan2(rotation[1, 0], rotation[0, 0])
        assert (cos(found.yaw), sin(found.yaw)) == pytest.approx((cos(turn), sin(turn)), abs=1e-12)

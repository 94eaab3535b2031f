from __future__ import annotations

import numpy as np
import pytest

from aeros.runtime.motion.kinematic_bounds import tool_rates
from aeros.sim.clock import TICK
from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.profile import UnreachableError, line_profile
from tests.unit.sim.robot.panda import PANDA, PANDA_BODY, QD_MAX, QDD_MAX, READY_POSTURE

START = (forward_kinematics(PANDA, READY_POSTURE[None, :])[0][0], 0.0)


@pytest.mark.parametrize("speed", [0.05, 0.25, 1.7])
def test_every_tick_of_a_profile_keeps_the_joint_limits(speed: float) -> None:
    profile = line_profile(PANDA, READY_POSTURE, START, (np.array([0.5, 0.3, 0.05]), 1.0), speed)
    rate = np.diff(np.vstack((READY_POSTURE, profile.sample()[0])), axis=0) / TICK
    change = np.diff(np.vstack((np.zeros(7), rate)), axis=0) / TICK
    assert (np.abs(rate) <= 0.51 * QD_MAX).all()
    assert (np.abs(change) <= 0.6 * QDD_MAX).all()


def test_the_tool_stays_on_the_line_and_below_the_asked_speed() -> None:
    target = np.array([0.5, 0.3, 0.05])
    profile = line_profile(PANDA, READY_POSTURE, START, (target, 0.0), 0.25)
    places = np.vstack((START[0], forward_kinematics(PANDA, profile.sample()[0])[0]))
    way = (target - START[0]) / np.linalg.norm(target - START[0])
    along = (places - START[0]) @ way
    off = np.linalg.norm(places - START[0] - along[:, None] * way, axis=1)
    assert off.max() < 1e-4
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() / TICK < 0.2501
    assert np.allclose(places[-1], target, atol=1e-4)


def test_a_profile_ends_at_rest() -> None:
    profile = line_profile(PANDA, READY_POSTURE, START, (np.array([0.5, 0.0, 0.3]), 0.0), 0.25)
    assert np.abs(profile.sample()[1][-1]).max() < 1e-9


def test_a_line_out_of_reach_is_refused_with_a_reason() -> None:
    with pytest.raises(UnreachableError, match="no joint position puts the tool"):
        line_profile(PANDA, READY_POSTURE, START, (np.array([0.9, 0.5, 0.3]), 0.0), 0.25)


@pytest.mark.parametrize("tilt", [0.02, 0.1, 0.2])
def test_a_motion_that_starts_off_its_line_keeps_the_decided_bounds(tilt: float) -> None:
    """As after a stop: the decision bounds the tool's speed and how fast it turns on its way to the line."""
    draw = np.random.default_rng(0)
    for _ in range(20):
        q = READY_POSTURE + draw.uniform(-tilt, tilt, 7)
        places, turned, _ = forward_kinematics(PANDA, q[None, :])
        yaw = float(np.arctan2(turned[0, 1, 0], turned[0, 0, 0]))
        target = places[0] + draw.uniform(-0.03, 0.03, 3)
        profile = line_profile(PANDA, q, (places[0], yaw), (target, yaw), 0.25)
        tool, turning = tool_rates(PANDA_BODY, profile.path, profile.ticks * TICK, 0.25)
        assert tool.speed <= 0.25
        assert tool.acceleration <= 13.0
        assert turning.speed <= 2.5
        assert turning.acceleration <= 25.0

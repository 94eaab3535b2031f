from __future__ import annotations

import numpy as np
import pytest

from aeros.sim.robot.kinematics import (
    downward_rotations,
    forward_kinematics,
    pose_error,
    solve_ik,
    solve_ik_one,
)
from aeros.sim.robot.robot import max_link_speed
from tests.unit.sim.robot.panda import PANDA, Q_MAX, Q_MIN, READY_POSTURE, ZEROS, with_zeros


def test_the_ready_posture_is_where_franka_says() -> None:
    p_tool, r_tool, _ = forward_kinematics(PANDA, READY_POSTURE[None, :])
    assert np.allclose(p_tool[0], (0.30689, 0.0, 0.48688), atol=1e-5)
    assert np.allclose(r_tool[0], np.diag((1.0, -1.0, -1.0)), atol=1e-9)


def test_solutions_reach_the_pose_within_a_tenth_of_a_millimetre_and_the_limits() -> None:
    chance = np.random.Generator(np.random.Philox(key=1))
    found = 0
    for _ in range(60):
        place = chance.uniform((0.3, -0.35, 0.02), (0.6, 0.35, 0.3))
        yaw = float(chance.uniform(-0.8, 0.8))
        q = solve_ik_one(PANDA, place, yaw, READY_POSTURE)
        if q is None:
            continue
        found += 1
        p_tool, r_tool, _ = forward_kinematics(PANDA, q[None, :])
        error = pose_error(p_tool, r_tool, place[None, :], downward_rotations(np.array([yaw])))
        assert np.abs(error).max() < 1e-4
        assert (q > Q_MIN).all()
        assert (q < Q_MAX).all()
    assert found == 60


def test_a_solution_depends_on_the_pose_and_not_on_where_the_arm_came_from() -> None:
    place, yaw = np.array([[0.5, 0.1, 0.2]]), np.array([0.3])
    one = solve_ik(PANDA, place, yaw, READY_POSTURE[None, :])
    other = solve_ik(PANDA, place, yaw, READY_POSTURE[None, :] + 0.2)
    assert one is not None
    assert other is not None
    assert np.abs(one - other).max() < 0.01


def test_a_pose_out_of_reach_has_no_solution() -> None:
    assert solve_ik_one(PANDA, np.array([1.2, 0.0, 0.3]), 0.0, READY_POSTURE) is None


def test_an_arm_whose_joints_count_from_elsewhere_is_the_same_arm() -> None:
    q = np.array([READY_POSTURE])
    for turned, expected in zip(
        forward_kinematics(with_zeros(PANDA), q - ZEROS), forward_kinematics(PANDA, q), strict=True
    ):
        assert turned == pytest.approx(expected, abs=1e-12)
    rates, base = [0.1] * 7, (0.0, 0.0, 0.0)
    assert max_link_speed(with_zeros(PANDA), (READY_POSTURE - ZEROS).tolist(), rates, base) == pytest.approx(
        max_link_speed(PANDA, READY_POSTURE.tolist(), rates, base)
    )

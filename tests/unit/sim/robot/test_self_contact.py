from __future__ import annotations

from aeros.sim.robot.kinematics import READY_POSTURE
from aeros.sim.robot.self_contact import find_self_contact


def test_nothing_touches_where_the_robot_starts() -> None:
    assert find_self_contact(READY_POSTURE.tolist()) is None


def test_a_hand_folded_into_the_forearm_is_found() -> None:
    assert find_self_contact([0.0, -0.785, 0.0, -2.356, 0.0, 0.05, -0.8]) == ("link5", "hand")


def test_a_hand_bent_into_the_foot_is_found() -> None:
    found = find_self_contact([0.0, 0.3, 0.0, -3.07, 0.0, 1.0, 0.785])
    assert found is None or found[0] in ("foot", "link1", "link2")

from __future__ import annotations

from aeros.sim.robot.self_contact import find_self_contact
from tests.unit.sim.robot.panda import PANDA, READY_POSTURE


def test_nothing_touches_where_the_robot_starts() -> None:
    assert find_self_contact(PANDA, READY_POSTURE.tolist()) is None


def test_a_hand_folded_into_the_forearm_is_found() -> None:
    assert find_self_contact(PANDA, [0.0, -0.785, 0.0, -2.356, 0.0, 0.05, -0.8]) == ("link5", "hand")


def test_a_forearm_bent_into_the_foot_is_found() -> None:
    assert find_self_contact(PANDA, [-1.97, 1.66, 0.09, -2.72, 0.72, 2.91, 0.65]) == ("foot", "link5")

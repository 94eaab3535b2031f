"""The log of postures: the nearest one in time, whatever form its values have."""

from __future__ import annotations

from aeros.runtime.perception.posture_log import PostureLog, value_of
from aeros.runtime.ports import Reading
from tests.unit.runtime.perception.test_obstacle_map import JOINTS, motion


def test_the_posture_nearest_in_time_is_returned_and_none_without_joints_or_base() -> None:
    log = PostureLog()
    log.note(motion(), 1.0, {"base_position": (9.0, 9.0, 0.0)})
    assert log.at(1.0) is None
    log.note(motion(), 2.0, {"joint_position": JOINTS, "base_position": Reading((1.0, 0.0, 0.0), 2.0)})
    log.note(motion(), 2.5, {"joint_position": Reading(JOINTS, 2.5)})
    log.note(motion(), 3.0, {"joint_position": Reading(JOINTS, 3.0), "base_position": (2.0, 0.0, 0.0)})
    first, second = log.at(2.4), log.at(2.6)
    assert first is not None
    assert second is not None
    assert (first.time, first.base, first.joints) == (2.0, (1.0, 0.0, 0.0), JOINTS)
    assert (second.time, second.base) == (3.0, (2.0, 0.0, 0.0))
    assert (value_of(4), value_of(Reading(5, 0.0))) == (4, 5)

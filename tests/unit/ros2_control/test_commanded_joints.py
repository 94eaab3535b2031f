"""Where resting joints are commanded."""

from __future__ import annotations

from aeros.ros2_control.commanded_joints import CommandedJoints

END = (0.5, 1.0)


def test_it_is_where_the_last_motion_ended_if_they_are_there() -> None:
    joints = CommandedJoints(0.003)
    joints.place = END
    joints.stand((0.502, 0.999))
    assert joints.at((0.0, 0.0)) == END


def test_it_is_where_they_are_if_something_has_moved_them() -> None:
    joints = CommandedJoints(0.003)
    joints.place = END
    joints.stand((0.51, 1.0))
    assert joints.at((0.0, 0.0)) == (0.51, 1.0)


def test_a_motion_that_begins_elsewhere_is_refused() -> None:
    joints = CommandedJoints(0.003)
    assert joints.stale_refusal(END) is None
    joints.stand(END)
    assert joints.stale_refusal((0.502, 1.0)) is None
    assert joints.stale_refusal((0.5, 1.01)) == (
        "stale: the motion begins 0.010000 rad or m from where the arm is commanded"
    )

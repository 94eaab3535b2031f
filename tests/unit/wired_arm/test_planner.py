import numpy as np
import pytest

from aeros.runtime.ports import MotionCompletion, NoMotion, Trajectory
from aeros.sim.robot.robot_file import read_robot
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.wired_arm.arm import ArmState
from aeros.wired_arm.planner import MotionPlanner, StandingRobot, mode_refusal
from tests.unit.franka.stub.arms import READY


def test_it_stands_where_the_real_arm_is_commanded() -> None:
    robot = StandingRobot(read_robot("franka_fr3"), (0.1, 0.0, 0.2))
    still = (0.0,) * 7
    robot.stand(ArmState(1.0, still, still, READY, still, still, 1, 0.0))
    sensed = robot.read_sensors()
    assert sensed.q == READY
    assert sensed.base_position == (0.1, 0.0, 0.2)
    place, _ = robot.tool_command()
    assert sensed.tool_position == pytest.approx([place[0] + 0.1, place[1], place[2] + 0.2])
    assert (robot.finger_forces(), robot.contact_force(), robot.wrist_vertical_force()) == (
        (0.0, 0.0),
        0.0,
        0.0,
    )


def test_it_has_no_motors() -> None:
    robot = StandingRobot(read_robot("franka_fr3"), (0.0, 0.0, 0.0))
    with pytest.raises(MisuseError):
        robot.command(np.zeros(7), np.zeros(7))
    with pytest.raises(MisuseError):
        robot.command_base(np.zeros(2), np.zeros(2))
    with pytest.raises(MisuseError):
        robot.grip(0.0, 1.0)


def planner() -> MotionPlanner:
    one = MotionPlanner(read_robot("franka_fr3"), (0.0, 0.0, 0.0), 0.0024)
    still = (0.0,) * 7
    one.stand(ArmState(1.0, still, still, READY, still, still, 1, 0.0))
    return one


@pytest.mark.parametrize(
    ("mode", "begins"),
    [
        (1, None),
        (2, None),
        (3, "not ready: the robot's mode is guiding"),
        (4, "reflex: "),
        (9, "not ready: "),
    ],
)
def test_a_robot_moves_in_some_of_its_modes(mode: int, begins: str | None) -> None:
    refusal = mode_refusal(mode)
    assert refusal is None if begins is None else str(refusal).startswith(begins)
    plan = planner().plan(Action("wait", {"duration": 1.0}), mode, has_hand=False)
    assert plan == (NoMotion("wait: nothing moves") if begins is None else MotionCompletion(False, refusal))


def test_a_plan_begins_where_the_arm_is_commanded_and_is_stale_anywhere_else() -> None:
    one = planner()
    plan = one.plan(
        Action("move_joints", {**{f"q{n}": q + 0.1 for n, q in enumerate(READY, 1)}, "speed": 0.1}),
        1,
        has_hand=False,
    )
    assert isinstance(plan, Trajectory)
    assert plan.joint_paths[0][0][0] == READY
    assert one.stale_refusal(plan) is None
    still = (0.0,) * 7
    for off, is_stale in ((0.002, False), (0.003, True)):
        one.stand(ArmState(1.0, still, still, tuple(q + off for q in READY), still, still, 1, 0.0))
        assert (one.stale_refusal(plan) is not None) is is_stale


def test_bad_parameters_are_refused_with_the_reason() -> None:
    assert planner().plan(Action("wait", {"duration": True}), 1, has_hand=False) == MotionCompletion(
        False, "bad parameter: `duration` is not a number"
    )

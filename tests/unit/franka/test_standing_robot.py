import numpy as np
import pytest

from aeros.franka.arm import ArmState
from aeros.franka.standing_robot import StandingRobot
from aeros.sim.robot.robot_file import read_robot
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.franka.arms import READY


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

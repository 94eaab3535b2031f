"""The Panda as links: its chain, its masses and its carriage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from aeros.sim.geometry import UPRIGHT, Pose, compose
from aeros.sim.mujoco.plans import ShapePlan, names_of_joints, names_of_links
from aeros.sim.mujoco.robot_plan import FINGERS, arm_joints, plan_robot
from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import RobotOptions
from tests.described import lines
from tests.reports_in_full import compare_with_section
from tests.unit.sim.robot.panda import FLANGE_TO_TOOL, PANDA, with_zeros


@pytest.mark.parametrize("model", [PANDA, with_zeros(PANDA)], ids=["panda", "zeros"])
def test_at_zero_the_links_are_where_the_kinematic_chain_has_them(model: RobotModel) -> None:
    at: dict[str | None, Pose] = {None: Pose((0.0, 0.0, 0.0), UPRIGHT)}
    for link in plan_robot(RobotOptions(model)):
        at[link.name] = compose(at[link.parent], link.place)
    tool = compose(at["hand"], Pose((0.0, 0.0, FLANGE_TO_TOOL), UPRIGHT)).position
    expected, *_ = forward_kinematics(model, np.zeros((1, 7)))
    assert tool == pytest.approx(tuple(expected[0].tolist()), abs=1e-12)


@pytest.mark.parametrize("carriage", [False, True])
def test_every_mass_has_moments_that_a_body_can_have(carriage: bool) -> None:
    for link in plan_robot(RobotOptions(PANDA, carriage=carriage)):
        if link.inertia is not None:
            a, b, c = np.linalg.eigvalsh(link.inertia.matrix).tolist()
            assert 0.0 < a <= b <= c < a + b + 1e-9


def test_the_arm_weighs_what_the_source_says() -> None:
    masses = [link.inertia.mass for link in plan_robot(RobotOptions(PANDA)) if link.inertia is not None]
    assert sum(masses) == pytest.approx(16.82, abs=0.01)


def test_the_carriage_comes_before_the_arm_and_the_fingers_last() -> None:
    links = plan_robot(RobotOptions(PANDA, carriage=True))
    joints = ["carriage_x", "carriage_y", *arm_joints(PANDA), *(f"{finger}_joint" for finger in FINGERS)]
    assert list(names_of_joints(links)) == joints
    assert names_of_links(links)["rail"] == -1
    assert names_of_links(plan_robot(RobotOptions(PANDA)))["foot"] == -1


def test_every_link_of_a_robot_with_and_without_a_carriage() -> None:
    expected = Path(__file__).with_name("robot_plan.txt")
    for name, options in (
        ("panda", RobotOptions(PANDA)),
        ("panda with a carriage", RobotOptions(PANDA, carriage=True, finger_friction=0.7)),
    ):
        links = [
            link._replace(shapes=tuple(_summed(one) for one in link.shapes)) for link in plan_robot(options)
        ]
        compare_with_section(expected, name, lines(links))


def _summed(shape: ShapePlan) -> ShapePlan:
    """Replace the corners of a hull by their number and sum."""
    corners = np.array(shape.corners).reshape(-1, 3)
    return shape._replace(corners=((len(corners), 0.0, 0.0), tuple(corners.sum(axis=0).tolist())))

"""A model that grows keeps the state of what it has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from aeros.sim.geometry import UPRIGHT, Pose
from aeros.sim.mujoco.client import mujoco
from aeros.sim.mujoco.model import GrowingModel, pose_of, wxyz
from aeros.sim.mujoco.plans import AT_ORIGIN, Friction, Inertia, JointPlan, LinkPlan, ShapePlan
from tests.described import lines, xml_lines
from tests.reports_in_full import compare_with_file

pytestmark = pytest.mark.physics

BALL = ShapePlan("sphere", (0.1, 0.0, 0.0))
SOME = Inertia(1.0, (0.0, 0.0, 0.0), np.eye(3) * 0.01)


def ball(name: str = "ball") -> tuple[LinkPlan, ...]:
    return (LinkPlan(name, None, AT_ORIGIN, None, SOME, (BALL,), Friction(0.5)),)


def pair(limits: tuple[float, float] | None = None) -> tuple[LinkPlan, ...]:
    joints = (
        JointPlan(name, True, axis, limits) for name, axis in (("a", (1.0, 0.0, 0.0)), ("b", (0.0, 1.0, 0.0)))
    )
    one, other = joints
    return (
        LinkPlan("base", None, AT_ORIGIN, None, None, (), Friction(0.5)),
        LinkPlan("one", "base", AT_ORIGIN, one, SOME, (BALL,), Friction(0.5)),
        LinkPlan("other", "base", AT_ORIGIN, other, SOME, (BALL,), Friction(0.5)),
    )


def run(model: GrowingModel, steps: int) -> None:
    built = model.built()
    for _ in range(steps):
        mujoco.mj_step(built.model, built.data)


def test_adding_a_body_keeps_the_motion_of_all_others() -> None:
    model = GrowingModel()
    first = model.add(ball(), Pose((0.0, 0.0, 5.0), UPRIGHT), moves=True)
    run(model, 10)
    before = model.built()
    state = (before.data.qpos.copy(), before.data.qvel.copy())
    assert model.built() is before
    second = model.add(ball(), Pose((3.0, 0.0, 1.0), UPRIGHT), moves=True)
    after = model.built()
    assert after is not before
    assert np.array_equal(after.data.qpos[:7], state[0])
    assert np.array_equal(after.data.qvel[:6], state[1])
    assert after.data.xpos[after.links[second, -1]].tolist() == [3.0, 0.0, 1.0]
    assert after.owners.tolist() == [[first, -1], [second, -1]]


def test_a_moved_body_stays_at_its_place() -> None:
    model = GrowingModel()
    moved = model.add_moved(BALL, ())
    model.move(moved, (1.0, 2.0, 3.0))
    model.add(ball(), AT_ORIGIN, moves=True)
    run(model, 5)
    built = model.built()
    assert built.data.xpos[built.links[moved, -1]].tolist() == [1.0, 2.0, 3.0]
    model.move(moved, (0.0, 0.0, 0.0))
    run(model, 5)
    assert built.data.ncon == 0  # it touches nothing
    model.add(ball(), Pose((9.0, 0.0, 0.0), UPRIGHT), moves=True)
    built = model.built()
    assert built.data.xpos[built.links[moved, -1]].tolist() == [0.0, 0.0, 0.0]


def test_frictions_are_those_last_set() -> None:
    model = GrowingModel()
    number = model.add(pair(), AT_ORIGIN, moves=False)
    model.set_link_friction(number, 1, 0.1)
    assert model.built().model.ngeom == 2
    assert model.frictions.tolist() == [[0.5, 0.02, 0.0], [0.1, 0.02, 0.0]]
    model.set_link_friction(number, 0, 0.9)
    assert model.frictions[:, 0].tolist() == [0.9, 0.1]
    model.set_joint_friction(number, 1, 0.7)
    assert model.built().model.dof_frictionloss.tolist() == [0.0, 0.7]
    model.add(ball(), Pose((3.0, 0.0, 0.0), UPRIGHT), moves=False)
    assert model.built().model.dof_frictionloss.tolist() == [0.0, 0.7]
    assert model.frictions[:, 0].tolist() == [0.9, 0.1, 0.5]


def test_coupled_joints_go_together_and_a_servo_draws_them_as_hard_as_it_may() -> None:
    model = GrowingModel()
    number = model.add(pair(), AT_ORIGIN, moves=False)
    model.set_contact(number, 0, 1, touch=False)
    model.couple(number, 0, 1)
    model.add_servo(number, 0, 100.0, 20.0)
    built = model.built()
    built.data.ctrl[0] = 0.3
    run(model, 1)
    assert built.data.actuator_force[0] == 1.0  # the range that it has until it is set
    built.model.actuator_forcerange[0] = (-50.0, 50.0)
    run(model, 3000)
    assert built.data.ncon == 0
    assert built.data.qpos.tolist() == pytest.approx([0.3, 0.3], abs=1e-3)


def test_a_joint_stops_at_its_limit() -> None:
    model = GrowingModel()
    number = model.add(pair((-0.1, 0.1)), AT_ORIGIN, moves=False)
    model.set_contact(number, 0, 1, touch=False)
    model.add_servo(number, 0, 100.0, 20.0)
    built = model.built()
    built.data.ctrl[0] = 0.3
    run(model, 2000)
    assert built.data.qpos[built.positions[number, 0]] == pytest.approx(0.1, abs=2e-3)
    assert built.data.qvel[built.speeds[number, 1]] == 0.0


def test_quaternions_change_their_order_there_and_back() -> None:
    pose = Pose((1.0, 2.0, 3.0), (0.1, 0.2, 0.3, 0.9))
    assert wxyz(pose.orientation) == (0.9, 0.1, 0.2, 0.3)
    assert pose_of(np.array(pose.position), np.array(wxyz(pose.orientation))) == pose


def test_the_description_of_a_model_with_everything_in_it() -> None:
    model = GrowingModel()
    shapes = (
        BALL,
        ShapePlan("box", (0.2, 0.4, 0.6), Pose((0.1, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))),
        ShapePlan("cylinder", (0.1, 0.5, 0.0)),
        ShapePlan("capsule", (0.1, 0.3, 0.0)),
        ShapePlan("hull", (0.0, 0.0, 0.0), corners=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))),
    )
    hinge = JointPlan("turn", False, (0.0, 0.0, 1.0), (-1.0, 2.0), armature=0.1, damping=0.2, friction=0.3)
    lopsided = Inertia(2.0, (0.01, 0.02, 0.03), np.array([[3.0, 0.1, 0.2], [0.1, 4.0, 0.3], [0.2, 0.3, 5.0]]))
    thing = (
        LinkPlan("thing", None, AT_ORIGIN, None, SOME, shapes, Friction(0.5, 0.01, 0.001)),
        LinkPlan("lid", "thing", Pose((0.0, 0.1, 0.2), UPRIGHT), hinge, lopsided, (BALL,), Friction(0.4)),
    )
    still = model.add(pair((-0.5, 0.5)), AT_ORIGIN, moves=False)
    moving = model.add(thing, Pose((1.0, 2.0, 3.0), (0.0, 1.0, 0.0, 0.0)), moves=True)
    moved = model.add_moved(BALL, ())
    model.couple(still, 0, 1)
    model.add_servo(still, 0, 100.0, 10.0)
    model.set_contact(still, 0, 1, touch=False)
    model.set_link_friction(still, 1, 0.9)
    model.set_joint_friction(moving, 0, 0.25)
    model.move(moved, (7.0, 8.0, 9.0))
    built = model.built()
    text = "\n".join(xml_lines(model._spec.to_xml()))
    values = (
        built.model.dof_frictionloss,
        model.frictions,
        built.owners,
        built.data.mocap_pos,
        built.data.xpos,
    )
    numbers = built.links, built.positions, built.speeds
    compare_with_file(Path(__file__).with_name("model.txt"), f"{text}\n{lines([*values, *numbers])}")

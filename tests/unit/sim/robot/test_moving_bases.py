"""Arms with prismatic joints: kinematics against both engines, speeds by differences, refusals of files."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from math import dist, inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.kinematic_chain import frames_of
from aeros.runtime.ports import MotionCompletion, Trajectory
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.contact_estimate import estimate_contact_force
from aeros.sim.robot.kinematics import forward_kinematics, solve_ik_one
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import max_link_speed
from aeros.sim.robot.robot_file import read_robot, robot_of
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.robot.moving_bases import (
    linear_axis,
    linear_axis_parts,
    linear_axis_site,
    turning_base,
    write_robot,
)

ARMS = [linear_axis, turning_base]


def postures(arm: RobotModel, count: int) -> np.ndarray[Any, Any]:
    chance = np.random.default_rng(5)
    found: np.ndarray[Any, Any] = chance.uniform(
        arm.limits.lowest, arm.limits.highest, (count, arm.joint_count)
    )
    return found


@pytest.mark.parametrize("make", ARMS)
def test_both_implementations_of_the_kinematics_agree_and_the_jacobian_is_the_derivative(
    make: Callable[[], RobotModel],
) -> None:
    arm, step = make(), 1e-6
    for q in postures(arm, 10):
        p, turned, jacobian = (one[0] for one in forward_kinematics(arm, q[None, :]))
        frame = frames_of(arm.mountings, q.tolist())[-1]
        assert p == pytest.approx(frame.to_base(arm.body.tool_offset), abs=1e-12)
        one = tool_kinematics(arm, q.tolist())
        assert one.position == pytest.approx(p, abs=1e-12)
        assert pytest.approx(jacobian[:3], abs=1e-12) == np.array(one.jacobian).T
        for joint in range(arm.joint_count):
            moved = q + step * np.eye(arm.joint_count)[joint]
            after, turned_after, _ = (one[0] for one in forward_kinematics(arm, moved[None, :]))
            skew = (turned_after - turned) @ turned.T / step
            assert jacobian[:3, joint] == pytest.approx((after - p) / step, abs=1e-5)
            assert jacobian[3:, joint] == pytest.approx((skew[2, 1], skew[0, 2], skew[1, 0]), abs=1e-5)


@pytest.mark.physics
@pytest.mark.parametrize("make", ARMS)
def test_the_tool_is_where_pybullet_and_mujoco_have_it(make: Callable[[], RobotModel]) -> None:
    from aeros.sim.bullet.client import bullet
    from aeros.sim.bullet.robot_urdf import load_robot_body
    from aeros.sim.mujoco.client import mujoco
    from aeros.sim.mujoco.robot import MujocoRobot
    from aeros.sim.mujoco.world import MujocoWorld
    from aeros.sim.robot.robot import RobotOptions

    arm = make()
    options = RobotOptions(arm)
    client = bullet.connect(bullet.DIRECT)
    loaded = load_robot_body(options, client)
    with closing(MujocoWorld()) as world:
        robot = MujocoRobot(world, options)
        built = world.bodies.built()
        for q in postures(arm, 20):
            expected, _, _ = forward_kinematics(arm, q[None, :])
            for joint, position in zip(loaded.arm, q.tolist(), strict=True):
                bullet.resetJointState(loaded.number, joint, position, physicsClientId=client)
            state = bullet.getLinkState(
                loaded.number, loaded.tool, computeForwardKinematics=1, physicsClientId=client
            )
            assert state[4] == pytest.approx(expected[0], abs=1e-5)
            built.data.qpos[: arm.joint_count] = q
            mujoco.mj_kinematics(built.model, built.data)
            mujoco.mj_comPos(built.model, built.data)
            robot._state = None
            assert robot.read_sensors().tool_position == pytest.approx(expected[0], abs=1e-6)
    bullet.disconnect(client)


@pytest.mark.parametrize("make", ARMS)
def test_the_fastest_link_is_the_fastest_end_of_a_capsule(make: Callable[[], RobotModel]) -> None:
    arm, step = make(), 1e-7
    chance = np.random.default_rng(6)
    ends = [(one.joint, end) for one in arm.capsules for end in (one.a, one.b)]
    ends.append((arm.joint_count, arm.body.tool_offset))
    for q in postures(arm, 10):
        rates = chance.uniform(-1.0, 1.0, arm.joint_count)
        before, after = (frames_of(arm.mountings, (q + x * rates).tolist()) for x in (0.0, step))
        fastest = max(dist(before[joint].to_base(p), after[joint].to_base(p)) / step for joint, p in ends)
        found = max_link_speed(arm, q.tolist(), rates.tolist(), (0.0, 0.0, 0.0))
        assert found == pytest.approx(fastest, rel=1e-4)


def test_a_target_beyond_the_arm_is_reached_along_its_axis() -> None:
    arm = linear_axis()
    target = np.array([0.5, 0.7, 0.3])
    q = solve_ik_one(arm, target, 0.4, arm.postures.ready)
    assert q is not None
    p, turned, _ = forward_kinematics(arm, q[None, :])
    assert p[0] == pytest.approx(target, abs=1e-4)
    assert np.arctan2(turned[0, 1, 0], turned[0, 0, 0]) == pytest.approx(0.4, abs=1e-4)
    assert (arm.lowest_solution <= q).all()
    assert (q <= arm.highest_solution).all()


def test_a_wrist_that_would_be_beyond_its_limits_goes_round_the_other_way() -> None:
    arm = linear_axis()
    q = solve_ik_one(arm, np.array([0.3, -0.4, 0.4]), np.pi, arm.postures.ready)
    assert q is not None
    assert q[-1] > 2.0


def test_a_push_on_the_tool_is_estimated_from_forces_and_torques() -> None:
    arm = linear_axis()
    push, q = np.array([0.0, 30.0, 0.0]), arm.postures.ready
    _, _, jacobian = forward_kinematics(arm, q[None, :])
    torques = jacobian[0, :3].T @ push
    assert torques[0] == pytest.approx(30.0)
    assert estimate_contact_force(arm, q.tolist(), torques.tolist()) == pytest.approx(30.0, rel=0.1)


@pytest.mark.parametrize("make", ARMS)
def test_it_slides_along_a_surface_and_stays_near_its_planned_paths(make: Callable[[], RobotModel]) -> None:
    with closing(make_plant(shipped_scene("bare"), 0, robot=make())) as plant:
        start = act("move_tool", target=(0.5, 0.0, 0.013), yaw=0.0, speed=0.25)
        for action in (act("grip", width=0.0, force=10.0), start):
            assert execute(plant, action, allow, inf).completed
        slide = act("slide", target=(0.5, 0.1, 0.0), force=6.0, speed=0.1)
        planned = plant.plan(slide)
        assert isinstance(planned, Trajectory)
        assert execute(plant, slide, allow, inf) == MotionCompletion(True)
        q = plant.observe()["joint_position"].value
        ends = [path[-1][3] for path in planned.joint_paths[1:]]
        # With equal shares of all joints the linear axis is 10 mm off after a third of the way.
        assert min(max(abs(a - b) for a, b in zip(q, end, strict=True)) for end in ends) < 0.006
        assert plant.observe()["tool_position"].value[:2] == pytest.approx((0.5, 0.1), abs=1e-4)


def test_masses_and_limits_keep_the_units_of_their_joints() -> None:
    arm = linear_axis()
    assert arm.limits.highest[:2] == pytest.approx([0.4, np.deg2rad(170.0)])
    assert arm.limits.speed[:2] == pytest.approx([1.0, np.deg2rad(85.0)])


Edit = Callable[[Any], None]


def _without_unit(file: Any) -> None:
    del file["limits"]["speed"]["prismatic_unit"]


def _turning_unit(file: Any) -> None:
    file["limits"]["speed"]["prismatic_unit"] = "rad/s"


def _sliding_unit(file: Any) -> None:
    file["limits"]["torque"]["unit"] = "N"


def _no_prismatic_joint(file: Any) -> None:
    del file["chain"][0]["joint"]


def _unknown_kind(file: Any) -> None:
    file["chain"][0]["joint"] = "linear"


def _only_prismatic(file: Any) -> None:
    for row in file["chain"]:
        row["joint"] = "prismatic"


def _crossed_limits(file: Any) -> None:
    file["limits"]["lowest"]["values"][0] = 0.5


def _endless_rail(file: Any) -> None:
    file["limits"]["highest"]["values"][0] = 1e9


def _elbow_that_slides(file: Any) -> None:
    file["chain"][3]["joint"] = "prismatic"


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (_without_unit, "`prismatic_unit` is missing: joint 1 is prismatic"),
        (_turning_unit, "expected a unit of m/s, found `rad/s`"),
        (_sliding_unit, "expected a unit of N*m, found `N`"),
        (_no_prismatic_joint, "no joint of the chain is prismatic"),
        (_unknown_kind, "linear"),
        (_only_prismatic, "no joint of the chain turns"),
        (_crossed_limits, "of joint 1, 0.5 m, is not below its highest, 0.4"),
        (_endless_rail, "joint 1 is prismatic, and its limit of 1e+09 m is beyond 100 m"),
        (_elbow_that_slides, "joint 4 is prismatic, and its limit of -170 m is beyond 100 m"),
    ],
)
def test_a_wrong_kind_or_unit_is_refused(edit: Edit, message: str, tmp_path: Path) -> None:
    file, hulls = linear_axis_parts()
    edit(file)
    with pytest.raises(UserError) as refused:
        read_robot(str(write_robot(tmp_path, file, hulls)))
    assert any(message in one.headline for one in refused.value.diagnostics)


def cell(folder: Path, text: str) -> Site:
    write_robot(folder, *linear_axis_parts())
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    diagnostics = Diagnostics()
    site = load_site(folder / "cell.yaml", diagnostics)
    assert site is not None, list(diagnostics)
    return site


def test_its_site_has_its_joints_in_jpos(tmp_path: Path) -> None:
    site = cell(tmp_path, linear_axis_site("iiwa_on_rail.yaml"))
    assert robot_of(site).name == "iiwa_on_rail"
    assert site.motion is not None
    assert site.motion.is_mixed
    assert float(site.motion.joint_limits[0][0]) == 1.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[1.0, 1.25,", "[0.5, 1.25,", "lever of joint 1 is 0.5; it is prismatic and needs 1 m/jpos"),
        ("[0.4, 2.9670,", "[0.5, 2.9670,", "a position of joint 1, m, of 0.5; the robot's limit is 0.4"),
        ("jpos", "rad", "joint 1 of the robot `iiwa_on_rail` is prismatic; the site has its joints in rad"),
    ],
)
def test_a_site_that_does_not_fit_a_prismatic_joint_is_refused(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    text = linear_axis_site("iiwa_on_rail.yaml").replace(old, new)
    if new == "rad":
        text = text.replace("/rad\n", "\n").replace("/rad,", ",")
    with pytest.raises(UserError) as refused:
        robot_of(cell(tmp_path, text))
    assert any(message in one.headline for one in refused.value.diagnostics)

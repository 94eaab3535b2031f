"""A standing arm on engines and in motions: it is where its file says, may be touched, and is kept off."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from math import inf
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from aeros.cli.main import main
from aeros.kinematic_chain import JointFrame, frames_of
from aeros.runtime.bus.robot_description import robot_description
from aeros.runtime.execution.detour_search import DetourSearch
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.port import Gate
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.perception.obstacle_map import ObstacleMap
from aeros.runtime.perception.posture_log import PostureLog
from aeros.runtime.ports import Reading
from aeros.sim.clock import TICK
from aeros.sim.geometry import Camera
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.pictures.late_picture import LatePicture
from aeros.sim.pictures.scene_solids import robot_solids
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.robot.robot_file import read_robot, reference_robot
from aeros.sim.robot.self_contact import find_self_contact
from aeros.sim.robot.standing_arms.standing_arm import with_postures
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
from tests.unit.runtime.one_step import FakeGate
from tests.unit.runtime.perception.kettle import site
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.robot.standing_arms.two_armed_robots import (
    two_pandas,
    write_two_armed_site,
    write_two_arms,
)

Vector = np.ndarray[Any, Any]

SCARA = Path(__file__).parents[1] / "scara" / "scara.yaml"
TOLERANCE = "tolerance: {unit: mrad, values: [5, 5, 5, 5, 5, 5, 5]}"
ON_THE_FIRST_LINK = f"""standing_arms:
  - prefix: left_
    robot: ARM
    at: [0.25, 0.0, 0.0]
    roll_pitch_yaw: [0.3, 1.5707963, 0.2]
    joint: 1
    posture: {{unit: rad, values: [0.0, 0.9, 0.0, -0.4, 0.0, 1.5, 0.785]}}
    {TOLERANCE}
"""
IN_FRONT = f"""standing_arms:
  - prefix: other_
    robot: panda
    at: [0.55, 0.0, 0.0]
    posture: {{unit: rad, values: [0.0, 0.0, 0.0, -0.4, 0.0, 1.5, 0.785]}}
    {TOLERANCE}
"""


OF_OTHER_MAKERS = f"""standing_arms:
  - prefix: pick_
    robot: {SCARA}
    at: [-0.3, 0.6, 0.0]
    roll_pitch_yaw: [0.0, 0.0, 1.5]
    posture: {{unit: rad, prismatic_unit: mm, values: [0.9, -2.0, 124, 1.0]}}
    tolerance: {{unit: mrad, prismatic_unit: mm, values: [1, 1, 1, 1]}}
  - prefix: iiwa_
    robot: kuka_iiwa14
    at: [0.0, -0.7, 0.0]
    posture: {{unit: deg, values: [0, 0, 0, -90, 0, 90, 0]}}
    {TOLERANCE}
"""
"""Arms with four and seven joints, one of them prismatic, and two kinds of grippers."""


@pytest.fixture
def carried(tmp_path: Path) -> RobotModel:
    """An arm on the first link of a Panda, with an arm of its own, so that frames of two mounts meet."""
    inner = IN_FRONT.replace("[0.55, 0.0, 0.0]", "[0.0, 0.8, 0.2]").replace("other_", "far_")
    write_two_arms(tmp_path, inner, name="pair")
    return read_robot(str(write_two_arms(tmp_path, ON_THE_FIRST_LINK.replace("ARM", "pair.yaml"))))


def frames_in_base(robot: RobotModel, q: Vector) -> Iterator[tuple[str, Vector]]:
    """The origins of the links of a robot and of all arms that stand on it, in its base's frame."""
    frames = frames_of(robot.mountings, q.tolist())
    yield from ((link, np.array(frames[joint].origin)) for joint, link in enumerate(robot.own_links[:-2]))
    for arm in robot.standing_arms:
        carrier = frames[arm.mount.joint]
        place = in_base(carrier, arm.mount.frame)
        for link, origin in frames_in_base(arm.model, np.array(arm.posture)):
            yield f"{arm.mount.prefix}{link}", np.array(place.to_base(tuple(origin.tolist())))


def in_base(outer: JointFrame, inner: JointFrame) -> JointFrame:
    return JointFrame(outer.to_base(inner.origin), *map(outer.rotate_to_base, inner[1:]))


POSTURE = np.array((0.4, -0.5, 0.3, -1.9, 0.2, 1.7, 0.5))


def test_links_are_where_mujoco_has_them(carried: RobotModel) -> None:
    from aeros.sim.mujoco.plans import names_of_links
    from aeros.sim.mujoco.robot import MujocoRobot
    from aeros.sim.mujoco.robot_plan import plan_robot
    from aeros.sim.mujoco.world import MujocoWorld

    for options in (RobotOptions(carried, posture=tuple(POSTURE)), RobotOptions(carried, carriage=True)):
        q = POSTURE if options.posture else carried.postures.ready
        with closing(MujocoWorld()) as world:
            robot, numbers = MujocoRobot(world, options), names_of_links(plan_robot(options))
            for link, origin in frames_in_base(carried, q):
                pose = world.link_pose(robot.body, numbers[link])
                assert pose.position == pytest.approx(origin, abs=1e-9), link


@pytest.mark.physics
def test_several_arms_of_other_makers_stand_on_both_engines(tmp_path: Path) -> None:
    from aeros.sim.bullet.robot_urdf import load_robot_body
    from aeros.sim.bullet.world import PhysicsWorld
    from aeros.sim.mujoco.robot_plan import hull_of_link, plan_robot

    robot = read_robot(str(write_two_arms(tmp_path, OF_OTHER_MAKERS)))
    names = {hull.link for hull in robot.body.hulls}
    assert len(names) == 27
    assert {hull_of_link(one.name) for one in plan_robot(RobotOptions(robot))} == names
    with closing(PhysicsWorld()) as world:
        assert load_robot_body(RobotOptions(robot), world.client).links.keys() == names


@pytest.mark.physics
@pytest.mark.deep
def test_links_are_where_pybullet_has_them(carried: RobotModel) -> None:
    from aeros.sim.bullet.client import bullet
    from aeros.sim.bullet.robot_urdf import load_robot_body
    from aeros.sim.bullet.world import PhysicsWorld

    for carriage in (False, True):
        with closing(PhysicsWorld()) as world:
            client = world.client
            loaded = load_robot_body(RobotOptions(carried, carriage=carriage), client)
            assert loaded.links.keys() == {hull.link for hull in carried.body.hulls}
            for joint, position in zip(loaded.arm, POSTURE.tolist(), strict=True):
                bullet.resetJointState(loaded.number, joint, position, physicsClientId=client)
            for link, origin in frames_in_base(carried, POSTURE):
                if link != "foot":
                    (number,) = loaded.links[link]
                    state = bullet.getLinkState(
                        loaded.number, number, computeForwardKinematics=1, physicsClientId=client
                    )
                    assert state[4] == pytest.approx(origin, abs=1e-5), link


def turned(robot: Any, step: Callable[[], object]) -> tuple[float, float]:
    """Turn the first joint to 1.05 rad; return where it is then, and the greatest force that was felt."""
    q, felt = robot.q_command, 0.0
    while q[0] < 1.05:
        speed = np.zeros(7)
        speed[0] = 0.6
        q = q + speed * TICK
        robot.command(q, speed)
        step()
        felt = max(felt, robot.contact_force())
    return robot.read_sensors().q[0], felt


REACHING = (0.7, 0.6, 0.0, -1.6, 0.0, 2.2, 0.8)


def on_mujoco(model: RobotModel) -> tuple[float, float]:
    from aeros.sim.mujoco.robot import MujocoRobot
    from aeros.sim.mujoco.world import MujocoWorld

    with closing(MujocoWorld()) as world:
        robot = MujocoRobot(world, RobotOptions(model, posture=REACHING))
        return turned(robot, world.step)


def on_pybullet(model: RobotModel) -> tuple[float, float]:
    from aeros.sim.bullet.robot import BulletRobot
    from aeros.sim.bullet.world import PhysicsWorld

    with closing(PhysicsWorld()) as world:
        robot = BulletRobot(world, RobotOptions(model, posture=REACHING))
        return turned(robot, world.step)


@pytest.mark.parametrize(
    "turn", [on_mujoco, pytest.param(on_pybullet, marks=(pytest.mark.physics, pytest.mark.deep))]
)
def test_the_standing_arm_is_in_the_way_of_the_other(
    turn: Callable[[RobotModel], tuple[float, float]],
) -> None:
    stopped_at, felt = turn(two_pandas())
    assert stopped_at < 0.92
    assert felt > 100.0
    reached, felt = turn(reference_robot())
    assert reached > 1.03
    assert felt < 5.0


def test_the_kinematic_plant_finds_the_contact_there() -> None:
    touching = (0.95, *REACHING[1:])
    found = find_self_contact(two_pandas(), touching)
    assert found is not None
    assert found[0].startswith("left_")
    assert find_self_contact(two_pandas(), REACHING) is None
    assert find_self_contact(reference_robot(), touching) is None


def test_on_mujoco_a_link_touches_what_stands_on_the_link_before_it(tmp_path: Path) -> None:
    from aeros.sim.mujoco.client import mujoco
    from aeros.sim.mujoco.plans import names_of_links
    from aeros.sim.mujoco.robot import MujocoRobot
    from aeros.sim.mujoco.robot_plan import plan_robot
    from aeros.sim.mujoco.world import MujocoWorld

    model = read_robot(
        str(write_two_arms(tmp_path, ON_THE_FIRST_LINK.replace("ARM", "panda").replace("0.25", "0.15")))
    )
    options = RobotOptions(model, posture=(0.0, 1.5, *REACHING[2:]))
    with closing(MujocoWorld()) as world:
        robot, numbers = MujocoRobot(world, options), names_of_links(plan_robot(options))
        built = world.bodies.built()
        mujoco.mj_collision(built.model, built.data)
        touching = {
            frozenset((world.bodies.geoms[a].link, world.bodies.geoms[b].link))
            for a, b in built.data.contact.geom.tolist()
            if world.bodies.geoms[a].body == world.bodies.geoms[b].body == robot.body
        }
    assert frozenset((numbers["link2"], numbers["left_foot"])) in touching
    assert frozenset((numbers["link1"], numbers["left_foot"])) not in touching


def to(x: float, y: float, z: float) -> Any:
    return act("move_tool", target=(x, y, z), yaw=0.0, speed=0.2)


def test_a_motion_into_the_other_arm_is_denied_by_name_and_a_way_leads_round_it(tmp_path: Path) -> None:
    robot = read_robot(str(write_two_arms(tmp_path, IN_FRONT)))
    motions, gate, target = MotionDecider(site().motion), FakeGate(site()), to(0.35, 0.4, 0.35)
    with closing(make_plant(shipped_scene("bare"), 0, robot=robot)) as plant:
        assert execute(plant, to(0.35, -0.4, 0.35), allow, inf).completed
        readings = plant.observe()
        allowed = Decision(DecisionKind.ALLOW, target, ())
        denied = motions.decide(allowed, plant.plan(target), readings, (), ())
        (reason,) = denied.reasons
        assert reason.code == "AE765"
        assert reason.rule.startswith("other_link")
        assert "of `other_link" in reason.text
        search = DetourSearch(
            site().motion, cast("Gate", gate), motions, cast("Any", plant), readings, plant.now(), {}
        )
        found = search.find(Caller("handling", "lift", {}), denied, target)
        assert found is not None
        for leg in found.legs:
            decided = motions.decide(
                Decision(DecisionKind.ALLOW, leg, ()), plant.plan(leg), plant.observe(), (), ()
            )
            assert decided.kind is DecisionKind.ALLOW
            assert execute(plant, leg, allow, inf).completed
        into = to(0.55, 0.0, 0.5)
        denied = motions.decide(
            Decision(DecisionKind.ALLOW, into, ()), plant.plan(into), plant.observe(), (), ()
        )
        assert denied.kind is DecisionKind.DENY
        assert search.find(Caller("handling", "lift", {}), denied, into) is None


@pytest.mark.deep
@pytest.mark.parametrize("plant", ["mujoco", pytest.param("physics", marks=pytest.mark.physics)])
def test_an_object_is_fetched_beside_the_standing_arm(
    plant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = str(write_two_armed_site(tmp_path))
    places = ["--out", str(tmp_path / "run"), "--state", str(tmp_path / "state")]
    assert main(["run", "fetch the object", "--plant", plant, "--site", cell, "--unsigned", *places]) == 0
    assert "goal reached: believed true, true in the simulator" in capsys.readouterr().out


def test_the_description_of_the_robot_has_the_standing_arm() -> None:
    body = two_pandas().body
    joints = [f"joint{number}" for number in range(1, 8)]
    whole = robot_description("two", body, joints)
    alone = robot_description("one", reference_robot().body, joints)
    assert whole.count("<sphere") == len(body.balls)
    assert alone.count("<sphere") == len(reference_robot().body.balls) < len(body.balls)


def test_a_standing_arm_over_the_bench_is_seen_and_is_no_obstacle() -> None:
    robot = with_postures(two_pandas(), (("left_", (-0.5, 0.3, 0.0, -1.7, 0.0, 2.0, 0.785)),))
    ready = tuple(robot.postures.ready.tolist())
    camera = Camera((0.6, 0.0, 2.2), (0.6, 0.0, 0.0), (1.0, 0.0, 0.0), 50.0, 160, 120)
    picture = LatePicture("overhead", 1.0, camera, [*robot_solids(robot, ready, (0.0, 0.0, 0.0))]).picture()
    motion, found = site().motion, {}
    assert motion is not None
    for name, body in (("both", robot.body), ("one", reference_robot().body)):
        postures = PostureLog()
        postures.note(motion, 1.0, {"joint_position": ready, "base_position": (0.0, 0.0, 0.0)})
        obstacles = ObstacleMap(postures)
        pictures = {"overhead": picture}
        readings = {"holding": Reading(False, 0.0)}
        obstacles.look(Configuration(site(), {}, {}, "c" * 64), pictures, readings, body)
        found[name] = [one.name for one in obstacles.obstacles()]
    assert found["both"] == []
    assert found["one"]

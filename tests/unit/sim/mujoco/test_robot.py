"""The Panda on MuJoCo holds by friction, feels what touches it, and keeps its links apart."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.sim.engine.world import GRAVITY
from aeros.sim.geometry import UPRIGHT, Pose
from aeros.sim.mujoco.engine import MujocoEngine
from aeros.sim.mujoco.robot import MujocoRobot
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.engine.declared_bodies import body
from tests.unit.sim.engine.engines import GREY
from tests.unit.sim.robot.panda import PANDA, READY_POSTURE

pytestmark = pytest.mark.physics


def make(*, carriage: bool = False) -> tuple[MujocoEngine, MujocoRobot]:
    engine = MujocoEngine()
    return engine, engine.add_robot(RobotOptions(PANDA, carriage=carriage), WheelOdometry(RandomSource(0)))


def held() -> tuple[MujocoEngine, MujocoRobot, int]:
    """A cube of 200 g between the fingers, which are 0.487 m high."""
    engine, robot = make()
    x, y, z = robot.read_sensors().tool_position
    stand = engine.add_box((0.1, 0.02, z - 0.02), (x, y, (z - 0.02) / 2.0), mass=0.0, colour=GREY)
    cube = engine.add_box((0.04, 0.04, 0.04), (x, y, z), mass=0.2, colour=GREY)
    robot.grip(0.0, 20.0)
    for _ in range(240):
        engine.world.step()
    assert engine.world.contacts(cube, stand)
    return engine, robot, cube


def lift(engine: MujocoEngine, robot: MujocoRobot) -> None:
    """Raise the hand by turning the fourth joint."""
    q = robot.q_command
    for tick in range(120):
        rate = np.array([0.0, 0.0, 0.0, 0.2 * min(1.0, tick / 24, (119 - tick) / 24), 0.0, 0.0, 0.0])
        q = q + rate / 240
        robot.command(q, rate)
        engine.world.step()


def test_fingers_hold_a_cube_by_friction_and_a_worn_pad_drops_it() -> None:
    engine, robot, cube = held()
    assert robot.is_holding()
    assert robot.finger_forces() == pytest.approx((20.0, 20.0), abs=1.0)
    assert robot.read_sensors().finger_gap == pytest.approx(0.04, abs=2e-3)
    height, hand = engine.world.pose(cube).position[2], robot.read_sensors().tool_position[2]
    lift(engine, robot)
    rise = robot.read_sensors().tool_position[2] - hand
    assert rise > 0.02
    assert engine.world.pose(cube).position[2] - height == pytest.approx(rise, abs=5e-3)
    links = {one.link_b for one in engine.world.contacts(cube, robot.body)}
    assert links == set(robot.fingers)
    robot.set_finger_friction(0.02)
    for _ in range(120):
        engine.world.step()
    assert engine.world.pose(cube).position[2] < height - 0.01 + rise


def test_a_push_on_the_hand_is_felt_by_the_motors_and_free_motion_is_not() -> None:
    engine, robot = make()
    lift(engine, robot)
    assert robot.contact_force() == 0.0
    built = engine.world.bodies.built()
    hand = built.links[robot.body, robot._hand]
    for _ in range(48):
        built.data.xfrc_applied[hand, :3] = (0.0, 0.0, 15.0)
        engine.world.step()
    # Found at the tool, 100 mm from where it pushes.
    assert robot.contact_force() == pytest.approx(15.0, abs=4.0)
    assert robot.net_contact_force() == 0.0


def test_the_wrist_feels_the_weight_of_a_lifted_cube() -> None:
    engine, robot, _ = held()
    before = robot.wrist_vertical_force()
    lift(engine, robot)
    for _ in range(60):
        engine.world.step()
    assert robot.wrist_vertical_force() - before == pytest.approx(-0.2 * GRAVITY, abs=0.6)


def test_links_that_can_meet_touch_and_neighbours_do_not() -> None:
    engine, robot = make()
    posture = READY_POSTURE.copy()
    posture[5] = 0.05  # the hand folds into the forearm
    for tick in range(1, 361):
        q = READY_POSTURE + (posture - READY_POSTURE) * min(1.0, tick / 300)
        robot.command(q, (posture - READY_POSTURE) / 1.25 if tick < 300 else np.zeros(7))
        engine.world.step()
    links = {frozenset((one.link_a, one.link_b)) for one in engine.world.contacts(robot.body, robot.body)}
    assert links
    assert all(abs(a - b) > 1 for a, b in map(sorted, links))


def test_the_carriage_carries_the_arm() -> None:
    engine, robot = make(carriage=True)
    box = engine.add_body(body(mass=0.0), Pose((5.0, 0.0, 0.05), UPRIGHT)).number
    start = robot.true_points()
    xy = np.zeros(2)
    for tick in range(120):
        speed = np.array([0.2 * min(1.0, tick / 48, (119 - tick) / 48), 0.0])
        xy = xy + speed / 240
        robot.command_base(xy, speed)
        engine.world.step()
    (bx, by, _), (tx, _, _) = robot.true_points()
    assert bx - start[0][0] == pytest.approx(xy[0], abs=2e-3)
    assert tx - start[1][0] == pytest.approx(xy[0], abs=4e-3)
    assert by == pytest.approx(0.0, abs=1e-3)
    assert engine.world.contacts(box) == []

"""The Panda in a physics world: it is built as ordered, follows its motors, and measures what it does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.clock import TICK
from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.robot.panda import FINGER_GAP_MAX, PANDA, READY_POSTURE, TAU_MAX

pytestmark = pytest.mark.physics


@pytest.fixture(params=[1, 2], ids=["240 Hz", "480 Hz"])
def world(request: pytest.FixtureRequest) -> Iterator[PhysicsWorld]:
    made = PhysicsWorld(request.param)
    yield made
    made.close()


def panda(world: PhysicsWorld, *, carriage: bool = False, z: float = 0.0) -> BulletRobot:
    return BulletRobot(world, RobotOptions(PANDA, carriage=carriage, base=(1.0, 2.0, z), finger_friction=0.8))


def steps(world: PhysicsWorld, count: int) -> None:
    for _ in range(count):
        world.step()


def test_it_stands_in_its_posture_with_open_fingers(world: PhysicsWorld) -> None:
    one = panda(world)
    steps(world, 1)
    state = one.read_sensors()
    assert state.q == pytest.approx(READY_POSTURE, abs=1e-3)
    assert state.finger_gap == pytest.approx(FINGER_GAP_MAX, abs=1e-3)
    assert (state.base_position, state.base_velocity) == ((1.0, 2.0, 0.0), (0.0, 0.0, 0.0))
    x, y, z = forward_kinematics(PANDA, READY_POSTURE[None, :])[0][0]
    assert state.tool_position == pytest.approx((x + 1.0, y + 2.0, z), abs=2e-3)
    assert one.grip_command == (FINGER_GAP_MAX, 10.0)


def test_it_holds_its_posture_against_its_weight(world: PhysicsWorld) -> None:
    one = panda(world)
    steps(world, 120)
    state = one.read_sensors()
    assert one.tracking_distance(state) < 0.002
    assert max(map(abs, state.qd)) < 0.01
    assert state.tool_speed < 0.005
    # The forearm and the hand, some 5 kg, hang on joint 4 and what is before it.
    assert max(map(abs, state.torque)) > 5.0
    assert np.all(np.abs(state.torque) <= TAU_MAX + 1e-6)


def test_the_arm_follows_its_set_points_and_a_weak_one_does_not(world: PhysicsWorld) -> None:
    one, target = panda(world), READY_POSTURE.copy()
    steps(world, 60)
    target[0] += 0.02
    one.command(target, np.zeros(7))
    assert one.q_command is target
    steps(world, 60)
    assert one.read_sensors().q[0] == pytest.approx(target[0], abs=1e-3)
    # Half of the strength still lifts the arm, none of it does not; the set points stay what they were.
    one.set_arm_motors(target, np.zeros(7), 0.5)
    steps(world, 60)
    assert one.tracking_distance(one.read_sensors()) < 0.01
    one.set_arm_motors(target, np.zeros(7), 0.0)
    steps(world, 60)
    assert one.tracking_distance(one.read_sensors()) > 0.05
    assert one.q_command is target


def test_both_fingers_close_together_and_a_weakened_grip_keeps_its_command(world: PhysicsWorld) -> None:
    one = panda(world)
    one.grip(0.04, 20.0)
    assert one.grip_command == (0.04, 20.0)
    steps(world, 12)
    moving = one.read_sensors()
    assert 0.04 < moving.finger_gap < FINGER_GAP_MAX
    assert moving.finger_speed == pytest.approx(0.05, rel=0.2)
    steps(world, 240)
    assert one.read_sensors().finger_gap == pytest.approx(0.04, abs=1e-3)
    left, right = (
        bullet.getJointState(one.body, finger, physicsClientId=world.client)[0] for finger in one.fingers
    )
    assert left == pytest.approx(right, abs=1e-3)
    one.set_finger_motors(0.0, 20.0)
    steps(world, 480)
    assert 0.0 <= one.read_sensors().finger_gap < 0.002
    assert one.grip_command == (0.04, 20.0)


def test_the_pads_friction_is_as_ordered_and_can_be_changed(world: PhysicsWorld) -> None:
    one = panda(world)

    def frictions() -> list[float]:
        return [
            bullet.getDynamicsInfo(one.body, finger, physicsClientId=world.client)[1]
            for finger in one.fingers
        ]

    assert one.finger_friction == 0.8
    assert frictions() == [0.8, 0.8]
    one.set_finger_friction(0.25)
    assert frictions() == [0.25, 0.25]
    assert one.finger_friction == 0.8


def test_a_held_cube_presses_on_both_fingers_and_its_weight_is_the_contact_force(world: PhysicsWorld) -> None:
    one = panda(world)
    steps(world, 2)
    x, y, z = one.read_sensors().tool_position
    cube = world.bodies.add_box((0.04, 0.04, 0.04), (x, y, z), mass=0.2, friction=1.0)
    stand = world.bodies.add_box((0.01, 0.01, 0.1), (x, y, z - 0.07))
    one.grip(0.03, 15.0)
    steps(world, 240)
    bullet.removeBody(stand, physicsClientId=world.client)
    steps(world, 120)
    assert one.is_holding()
    left, right = one.finger_forces()
    assert left == pytest.approx(15.0, abs=4.0)
    assert right == pytest.approx(15.0, abs=4.0)
    assert one.contact_force() == pytest.approx(0.2 * 9.81, abs=0.5)
    assert world.pose(cube).position[2] == pytest.approx(z, abs=0.01)


def test_a_carriage_drives_to_its_set_point_and_carries_the_arm(world: PhysicsWorld) -> None:
    one = panda(world, carriage=True, z=0.5)
    steps(world, 10)
    assert one.read_sensors().base_position == pytest.approx((1.0, 2.0, 0.5), abs=1e-3)
    before = one.read_sensors().tool_position
    way = np.array([0.1, -0.05])
    for tick in range(1, 241):  # 1 s of a profile of minimum jerk, 10 s³ - 15 s⁴ + 6 s⁵
        s = tick * TICK
        one.command_base(way * s**3 * (10 - 15 * s + 6 * s * s), way * 30 * s * s * (1 - s) ** 2)
        world.step()
        moving = one.read_sensors()
        assert np.linalg.norm(one.base_tracking_error(moving)) < 0.005
        if tick == 120:
            assert moving.base_velocity == pytest.approx((0.1875, -0.09375, 0.0), abs=0.01)
    one.hold_base()
    steps(world, 120)
    state = one.read_sensors()
    assert state.base_position == pytest.approx((1.1, 1.95, 0.5), abs=2e-3)
    moved = np.subtract(state.tool_position, before)
    assert moved == pytest.approx((0.1, -0.05, 0.0), abs=5e-3)


def test_a_surface_under_the_pressing_hand_pushes_the_wrist_up(world: PhysicsWorld) -> None:
    one = panda(world)
    steps(world, 60)
    before = one.wrist_vertical_force()
    assert one.contact_force() < 0.1
    x, y, z = one.read_sensors().tool_position
    world.bodies.add_box((0.2, 0.2, 0.1), (x, y, z - 0.053))
    steps(world, 60)
    assert one.contact_force() > 1.0
    assert one.wrist_vertical_force() > before

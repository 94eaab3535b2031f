"""Set points, brakes and what follows them, on a robot with scripted sensors."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from aeros.sim.clock import TICK
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.robot import BASE_ACCELERATION_MAX, Robot, RobotOptions, RobotState
from tests.unit.sim.robot.panda import PANDA, QDD_MAX, READY_POSTURE


class Scripted(Robot):
    """Arm that notes its set points, and measures given positions, by default its set points."""

    def __init__(self, *, carriage: bool = True) -> None:
        super().__init__(RobotOptions(PANDA, carriage=carriage, base=(1.0, 2.0, 0.5)))
        self.arm: list[tuple[Vector, Vector]] = []
        self.base: list[tuple[Vector, Vector]] = []
        self.sensed: dict[str, Any] = {}
        self.forces = (0.0, 0.0)

    def command(self, q: Vector, qd: Vector) -> None:
        self.q_command, self.qd_command = q, qd
        self.arm.append((q, qd))

    def command_base(self, xy: Vector, speed: Vector) -> None:
        self.base_command, self.base_speed_command = xy, speed
        self.base.append((xy, speed))

    def grip(self, width: float, force: float) -> None:
        raise AssertionError

    def read_sensors(self) -> RobotState:
        x, y = (self.base_origin + self.base_command + self.base_speed_command * TICK).tolist()
        state = RobotState(
            q=tuple((self.q_command + self.qd_command * TICK).tolist()),
            qd=tuple(self.qd_command.tolist()),
            torque=(0.0,) * 7,
            tool_position=(0.0, 0.0, 0.0),
            tool_speed=0.0,
            finger_gap=0.0,
            finger_speed=0.0,
            base_position=(x, y, 0.5),
            base_velocity=(*self.base_speed_command.tolist(), 0.0),
        )
        return state._replace(**self.sensed)

    def finger_forces(self) -> tuple[float, float]:
        return self.forces

    def contact_force(self) -> float:
        raise AssertionError

    def wrist_vertical_force(self) -> float:
        raise AssertionError


def moving(*, carriage: bool = True, rate: float = 0.3, speed: tuple[float, float] = (0.0, 0.0)) -> Scripted:
    """A robot whose joint 2, and whose carriage, are under way."""
    made = Scripted(carriage=carriage)
    qd = np.zeros(7)
    qd[1] = rate
    made.command(made.q_command, qd)
    made.command_base(np.array([0.5, 0.25]), np.array(speed))
    made.arm.clear()
    made.base.clear()
    return made


def test_it_begins_at_rest_in_its_posture() -> None:
    made = Scripted()
    assert made.q_command.tolist() == READY_POSTURE.tolist()
    assert not made.qd_command.any()
    assert made.base_origin.tolist() == [1.0, 2.0]
    assert made.has_carriage
    assert not Scripted(carriage=False).has_carriage


def test_holding_keeps_the_set_points_and_takes_their_speed() -> None:
    made = moving(speed=(0.1, 0.2))
    made.hold()
    assert made.q_command.tolist() == READY_POSTURE.tolist()
    assert made.base_command.tolist() == [0.5, 0.25]
    assert not made.qd_command.any()
    assert not made.base_speed_command.any()
    fixed = moving(carriage=False)
    fixed.hold()
    assert (len(fixed.arm), len(fixed.base)) == (1, 0)


def test_an_arm_brakes_evenly_as_hard_as_its_limits_allow() -> None:
    # Joint 2 brakes with 0.9 of 7.5 rad/s²: 0.3 rad/s take 44.4 ms, 10.7 ticks, so 11 and one to come on.
    made = moving()
    count = sum(1 for _ in made.brake())
    rates = [float(qd[1]) for _, qd in made.arm]
    assert count == 12
    assert len(rates) == 13  # and then it holds
    assert rates[:3] == pytest.approx([0.3 * (1.0 - share / 11.0) for share in (0.5, 1.5, 2.5)])
    assert rates[-2:] == [0.0, 0.0]
    changes = np.diff([0.3, *rates]) / TICK
    assert np.abs(changes).max() <= 7.5
    # Evenly: half the speed over 11 ticks and one half more at either end.
    way = made.q_command[1] - READY_POSTURE[1]
    assert way == pytest.approx(0.3 * 12.0 / 2.0 * TICK, rel=0.01)
    assert [float(q[1]) for q, _ in made.arm] == sorted(float(q[1]) for q, _ in made.arm)


def test_the_slowest_joint_decides_and_all_come_to_rest_together() -> None:
    made = moving()
    qd = QDD_MAX * 0.02
    qd[3] = QDD_MAX[3] * 0.04
    made.command(made.q_command, qd)
    made.arm.clear()
    assert sum(1 for _ in made.brake()) == 12  # 0.04/0.9 s are 10.7 ticks
    for _, rate in made.arm[:-2]:
        assert rate / qd == pytest.approx(np.full(7, rate[0] / qd[0]))
    assert len(made.base) == 1  # it holds


def test_a_carriage_brakes_with_its_own_limit() -> None:
    # 0.05 m/s at 1 m/s² take 12 ticks.
    made = moving(rate=0.0, speed=(0.03, -0.04))
    assert sum(1 for _ in made.brake()) == 13
    speeds = [float(np.linalg.norm(speed)) for _, speed in made.base]
    assert speeds[0] == pytest.approx(0.05 * (1.0 - 0.5 / 12.0))
    assert np.abs(np.diff([0.05, *speeds])).max() / TICK <= BASE_ACCELERATION_MAX * (1.0 + 1e-9)
    assert speeds[-1] == 0.0
    dx, dy = made.base_command - np.array([0.5, 0.25])
    assert dx / dy == pytest.approx(-0.75)


def test_only_the_asked_parts_brake() -> None:
    arm = moving(speed=(0.05, 0.0))
    list(arm.brake({"arm"}))
    assert arm.arm
    assert not arm.base
    base = moving(speed=(0.05, 0.0))
    list(base.brake({"base"}))
    assert base.base
    assert not base.arm
    still = moving(rate=0.0)
    assert list(still.brake()) == []
    assert (len(still.arm), len(still.base)) == (1, 1)


def test_a_joint_that_follows_is_braked_from_its_set_point() -> None:
    made = moving()
    q, qd = made.followed_set_points()
    assert q.tolist() == made.q_command.tolist()
    assert qd.tolist() == made.qd_command.tolist()
    # Within 6 mrad and 0.05 rad/s it follows.
    near = made.q_command + made.qd_command * TICK
    near[2] += 0.0059
    made.sensed = {"q": tuple(near.tolist())}
    assert made.followed_set_points()[0].tolist() == made.q_command.tolist()


def test_a_hindered_joint_is_braked_from_where_it_is() -> None:
    made = moving()
    there = made.q_command + made.qd_command * TICK
    there[2] += 0.0061
    made.sensed = {"q": tuple(there.tolist())}
    q, qd = made.followed_set_points()
    assert q[2] == pytest.approx(made.q_command[2] + 0.0061)
    assert q[1] == made.q_command[1]
    rates = made.qd_command.copy()
    rates[1] = 0.2
    made.sensed = {"qd": tuple(rates.tolist())}
    q, qd = made.followed_set_points()
    assert qd[1] == 0.2
    # A tick ahead, as a set point is.
    assert q[1] == pytest.approx(made.q_command[1] + (0.3 - 0.2) * TICK)


def test_a_hindered_carriage_is_braked_from_where_it_is() -> None:
    made = moving(speed=(0.1, 0.2))
    xy, speed = made.followed_base_set_points()
    assert (xy.tolist(), speed.tolist()) == ([0.5, 0.25], [0.1, 0.2])
    made.sensed = {"base_position": (1.5 + 0.0051 + 0.1 * TICK, 2.25 + 0.0049 + 0.2 * TICK, 0.5)}
    xy, _ = made.followed_base_set_points()
    assert xy.tolist() == pytest.approx([0.5051, 0.25])
    made.sensed = {"base_velocity": (0.079, 0.219, 0.0)}
    xy, speed = made.followed_base_set_points()
    assert speed.tolist() == [0.079, 0.2]
    assert xy.tolist() == pytest.approx([0.5 + 0.021 * TICK, 0.25])


def test_yielding_makes_the_measured_positions_the_set_points() -> None:
    made = moving(speed=(0.1, 0.2))
    made.sensed = {"q": (0.1, 0.2, 0.3, -1.0, 0.5, 0.6, 0.7), "base_position": (1.25, 2.5, 0.5)}
    made.yield_to_contact()
    assert made.q_command.tolist() == [0.1, 0.2, 0.3, -1.0, 0.5, 0.6, 0.7]
    assert made.base_command.tolist() == [0.25, 0.5]
    assert not made.qd_command.any()
    assert not made.base_speed_command.any()


def test_the_commanded_tool_is_where_the_kinematics_put_it() -> None:
    made = Scripted()
    place, yaw = made.tool_command()
    assert place == pytest.approx((0.30689, 0.0, 0.48688), abs=1e-5)
    assert yaw == pytest.approx(0.0, abs=1e-9)
    turned = READY_POSTURE.copy()
    turned[0] = pi / 2
    made.command(turned, np.zeros(7))
    place, yaw = made.tool_command()
    assert place == pytest.approx((0.0, 0.30689, 0.48688), abs=1e-5)
    assert yaw == pytest.approx(pi / 2)


def test_tracking_errors_are_distances_from_the_set_points() -> None:
    made = moving(rate=0.0)
    q = made.q_command.copy()
    q[0] += 0.01
    q[4] -= 0.02
    made.sensed = {"q": tuple(q.tolist()), "base_position": (1.5 + 0.3, 2.25 - 0.4, 0.5)}
    state = made.read_sensors()
    assert made.base_tracking_error(state) == pytest.approx((-0.3, 0.4, 0.0))
    assert made.tracking_distance(state) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("forces", "holds"),
    [((0.0, 0.0), False), ((2.0, 9.0), False), ((9.0, 1.99), False), ((2.01, 2.01), True)],
)
def test_something_is_held_if_both_fingers_press(forces: tuple[float, float], holds: bool) -> None:
    made = Scripted()
    made.forces = forces
    assert made.is_holding() is holds

from math import dist
from typing import Any

import pytest

from aeros.sim.robot.robot_file import read_robot
from aeros.wired_arm.arm import CYCLE, USER_STOPPED, ArmState
from aeros.wired_arm.measurements import Measurements
from tests.unit.franka.stub.arms import READY

MODEL = read_robot("franka_fr3")
STILL = (0.0,) * 7
NAMES = (
    "joint_position",
    "joint_velocity",
    "joint_torque",
    "joint_torque_rate",
    "tool_position",
    "tool_speed",
    "link_speed",
    "tracking_error",
    "contact_force",
    "estop_pressed",
    "base_position",
)


def state(time: float = 1.0, **changes: Any) -> ArmState:
    return ArmState(time, READY, STILL, READY, STILL, STILL, 1, 0.0)._replace(**changes)


def measure() -> Measurements:
    return Measurements(MODEL, (0.0, 0.0, 0.5), NAMES)


def test_an_arm_that_stands_free_measures_nothing_else() -> None:
    values = measure().take(state())
    assert set(values) == set(NAMES)
    for name in ("tool_speed", "link_speed", "tracking_error", "contact_force"):
        assert values[name] == 0.0
    assert values["estop_pressed"] is False
    assert values["base_position"] == (0.0, 0.0, 0.5)


def test_the_speed_of_the_tool_is_that_of_its_place() -> None:
    rates = (0.3, -0.2, 0.1, 0.4, -0.3, 0.2, 0.5)
    moved = tuple(q + 1e-6 * rate for q, rate in zip(READY, rates, strict=True))
    here, there = measure().take(state()), measure().take(state(q=moved, q_d=moved))
    speed = dist(here["tool_position"], there["tool_position"]) / 1e-6
    values = measure().take(state(dq=rates))
    assert values["tool_speed"] == pytest.approx(speed, rel=1e-4)
    assert values["link_speed"] >= values["tool_speed"] - 1e-9


def test_the_tracking_error_is_that_of_the_farthest_link() -> None:
    off = (READY[0] + 0.01, *READY[1:])
    values = measure().take(state(q=off))
    x, y, _ = values["tool_position"]
    assert values["tracking_error"] == pytest.approx(0.01 * (x * x + y * y) ** 0.5, rel=0.05)


def test_a_torque_that_the_model_does_not_explain_is_a_contact() -> None:
    assert measure().take(state(external_torque=(0.0, 15.0, 0.0, 0.0, 0.0, 0.0, 0.0)))["contact_force"] > 20.0


def test_rates_of_torques_are_filtered() -> None:
    taken = measure()
    taken.take(state(1.0))
    rate = taken.take(state(1.0 + CYCLE, torque=(1.0, *STILL[1:])))["joint_torque_rate"]
    # 1 N·m in 1 ms through a filter of 30 Hz.
    assert rate[0] == pytest.approx(1000.0 * CYCLE / (CYCLE + 1.0 / (2.0 * 3.14159265 * 30.0)), rel=1e-6)
    assert rate[1:] == STILL[1:]


def test_a_person_at_the_stop_button_is_measured() -> None:
    assert measure().take(state(mode=USER_STOPPED))["estop_pressed"] is True


def test_variables_that_the_site_does_not_declare_are_not_measured() -> None:
    assert set(Measurements(MODEL, (0.0, 0.0, 0.0), ["tool_speed", "human_distance"]).take(state())) == {
        "tool_speed"
    }

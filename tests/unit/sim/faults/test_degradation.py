"""Degraded parts, tick by tick, on a robot that only notes its motors."""

from __future__ import annotations

from math import inf
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.clock import TICK
from aeros.sim.faults.degradation import NO_DEGRADATION, Degradation, DegradationApplier
from aeros.sim.physics import PlantParts
from aeros.sim.sensor_model import SensorModel


class Robot:
    """Notes what is set; its commanded set point is a ramp of 1 rad/s."""

    def __init__(self) -> None:
        self.finger_friction, self.grip_command = 0.8, (0.04, 20.0)
        self.frictions: list[float] = []
        self.grips: list[tuple[float, float]] = []
        self.arm: list[tuple[float, float, float]] = []
        self.at(0)

    def at(self, tick: int) -> None:
        self.q_command, self.qd_command = np.array([tick * TICK]), np.array([1.0])

    def set_finger_friction(self, friction: float) -> None:
        self.frictions.append(friction)

    def set_finger_motors(self, width: float, force: float) -> None:
        self.grips.append((width, force))

    def set_arm_motors(self, q: Any, qd: Any, strength: float) -> None:
        self.arm.append((float(q[0]) / TICK, float(qd[0]), strength))


class Applied:
    """An applier and the parts that it acts on."""

    def __init__(self, **models: SensorModel) -> None:
        self.robot = Robot()
        self.models = dict(models)
        sensors = SimpleNamespace(models=self.models)
        self.scanners = SimpleNamespace(covered={}, silent=frozenset())
        parts = SimpleNamespace(robot=self.robot, sensors=sensors, scanners=self.scanners)
        self._applier = DegradationApplier(cast("PlantParts", parts))
        self._tick = 0

    def tick(self, now: Degradation = NO_DEGRADATION) -> None:
        self._tick += 1
        self.robot.at(self._tick)
        self._applier.apply(now)


NOISY, LATE = SensorModel(noise=0.5, dropout=0.25), SensorModel(noise=0.25, latency=0.125)


# Combining.


def test_the_worse_of_two_counts_for_each_part() -> None:
    first = Degradation(0.5, 10.0, 0.25, 3, {"a": NOISY, "b": NOISY})
    second = Degradation(0.75, 5.0, 0.5, 7, {"a": LATE, "c": LATE})
    worse = Degradation(0.5, 5.0, 0.25, 7, {"a": SensorModel(0.5, 0.0, 0.125, 0.25), "b": NOISY, "c": LATE})
    assert first.combine_worst(second) == second.combine_worst(first) == worse
    dirty = Degradation(covered={"a": 0.2, "b": 0.5}, silent=frozenset("c"))
    other = Degradation(covered={"b": 0.7}, silent=frozenset("d"))
    both = Degradation(covered={"a": 0.2, "b": 0.7}, silent=frozenset("cd"))
    assert dirty.combine_worst(other) == other.combine_worst(dirty) == both
    coarse = Degradation(sensors={"a": SensorModel(resolution=0.5)})
    assert first.combine_worst(coarse).sensors["a"] == SensorModel(0.5, 0.5, 0.0, 0.25)


_DEGRADATIONS = st.builds(
    Degradation,
    st.floats(0.0, 2.0),
    st.floats(0.0, 100.0) | st.just(inf),
    st.floats(0.0, 1.0),
    st.integers(0, 9),
    st.dictionaries(st.sampled_from("ab"), st.sampled_from([NOISY, LATE, SensorModel(resolution=1.0)])),
)


@given(_DEGRADATIONS, _DEGRADATIONS, _DEGRADATIONS)
def test_combining_has_no_order_and_none_changes_nothing(
    a: Degradation, b: Degradation, c: Degradation
) -> None:
    assert a.combine_worst(b) == b.combine_worst(a)
    assert a.combine_worst(b).combine_worst(c) == a.combine_worst(b.combine_worst(c))
    assert a.combine_worst(NO_DEGRADATION) == a.combine_worst(a) == a


# Applying.


def test_scanners_are_covered_and_silent_for_as_long_as_it_lasts() -> None:
    one = Applied()
    one.tick(Degradation(covered={"a": 0.5}, silent=frozenset("b")))
    assert (one.scanners.covered, one.scanners.silent) == ({"a": 0.5}, {"b"})
    one.tick()
    assert (one.scanners.covered, one.scanners.silent) == ({}, set())


def test_without_degradation_nothing_is_touched() -> None:
    one = Applied(a=NOISY)
    for _ in range(3):
        one.tick()
    assert (one.robot.frictions, one.robot.grips, one.robot.arm) == ([], [], [])
    assert one.models == {"a": NOISY}


def test_friction_is_set_when_it_changes_and_never_above_the_pads_own() -> None:
    one = Applied()
    for friction in (0.5, 0.5, 0.25, 0.9):
        one.tick(Degradation(friction=friction))
    one.tick()
    assert one.robot.frictions == [0.5, 0.25, 0.8, 0.8]


def test_the_grip_is_weakened_every_tick_and_restored_once() -> None:
    one = Applied()
    one.tick(Degradation(force=5.0))
    one.tick(Degradation(force=50.0))
    one.robot.grip_command = (0.02, 3.0)
    one.tick(Degradation(force=5.0))
    one.tick()
    one.tick()
    assert one.robot.grips == [(0.04, 5.0), (0.04, 20.0), (0.02, 3.0), (0.02, 3.0)]


def test_a_weak_arm_follows_its_commands_and_is_strong_again() -> None:
    one = Applied()
    one.tick(Degradation(torque_share=0.5))
    one.tick(Degradation(torque_share=0.25))
    one.tick()
    one.tick()
    assert one.robot.arm == pytest.approx(np.array([(1.0, 1.0, 0.5), (2.0, 1.0, 0.25), (3.0, 1.0, 1.0)]))


def test_a_late_arm_waits_follows_late_and_catches_up_at_twice_the_pace() -> None:
    one = Applied()
    for _ in range(6):
        one.tick(Degradation(lag_ticks=3))
    for _ in range(4):
        one.tick()
    # It waits in tick 0's place for three ticks, is three late, and catches up by two places a tick.
    places = [q for q, _, _ in one.robot.arm]
    assert places == pytest.approx([0, 0, 0, 1, 2, 3, 5, 7, 9], abs=1e-9)
    assert [speed for _, speed, _ in one.robot.arm] == [0.0] * 3 + [1.0] * 6
    assert {share for _, _, share in one.robot.arm} == {1.0}


def test_sensors_are_as_bad_as_built_or_degraded_and_as_built_again() -> None:
    one = Applied(a=NOISY)
    one.tick(Degradation(sensors={"a": LATE, "b": LATE}))
    assert one.models == {"a": SensorModel(0.5, 0.0, 0.125, 0.25), "b": LATE}
    one.tick(Degradation(sensors={"b": NOISY}))
    assert one.models == {"a": NOISY, "b": NOISY}
    one.tick()
    assert one.models == {"a": NOISY}

"""Base class of simulators with ticks: plans, motions under way, monitor, and coming to rest."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

import pytest

from aeros.runtime.ports import (
    CameraPicture,
    CameraView,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    Reading,
    Readings,
    Trajectory,
)
from aeros.sim.clock import TICK
from aeros.sim.fixed_step_plant import CAMERA_TICKS, FixedStepPlant, PictureSource
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.robot import KinematicRobot
from aeros.sim.robot.errors import BlockedError
from aeros.sim.robot.robot import RobotOptions
from aeros.skill import Action, act
from tests.unit.sim.acting import allow
from tests.unit.sim.robot.panda import PANDA

JOINTS = {"q1": 0.3, "q2": -0.7, "q3": 0.0, "q4": -2.3, "q5": 0.0, "q6": 1.6, "q7": 0.8}
TURN = act("move_joints", **JOINTS, speed=0.5)
DRIVE = act("move_base", x=0.5, y=0.0, speed=0.5)
WAIT = act("wait", duration=0.1)
DONE = MotionCompletion(True)
VIEW = CameraView((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 50.0)


class Bench(FixedStepPlant):
    """A robot without physics on a carriage, with a camera, which is blocked and pressed on demand."""

    def __init__(self) -> None:
        self.ticks = 0
        self.sees = b"cup"
        self.blocked_at = inf
        self.arm = Pressed(RobotOptions(PANDA, carriage=True), ObjectSet((), ()))
        super().__init__(self.arm, ("mast",))

    def now(self) -> float:
        return self.ticks * TICK

    def observe(self) -> Readings:
        return {name: Reading(value, self.now()) for name, value in self._fast_values().items()}

    def _step_world(self) -> None:
        self.ticks += 1
        self.arm.tick()

    def _look(self, camera: str) -> PictureSource:
        picture = CameraPicture(camera, self.now(), 1, 1, self.sees, None, VIEW)
        return lambda: picture

    def _check_tracking(self) -> None:
        if self.ticks >= self.blocked_at:
            raise BlockedError("blocked: by a test")


class Pressed(KinematicRobot):
    """Feels a scripted contact force, which falls by 20 N whenever it yields."""

    force = 0.0
    yielded = 0

    def contact_force(self) -> float:
        return self.force

    def yield_to_contact(self) -> None:
        self.yielded += 1
        self.force = max(0.0, self.force - 20.0)
        super().yield_to_contact()


def begin(plant: Bench, action: Action) -> MotionHandle:
    motion = plant.begin(action)
    assert isinstance(motion, int)
    return motion


def q1(plant: Bench) -> float:
    return float(plant.observe()["joint_position"].value[0])


# Plans.


def test_a_plan_starts_as_it_was_made() -> None:
    plant = Bench()
    plan = plant.plan(TURN)
    assert isinstance(plan, Trajectory)
    assert plant.ticks == 0
    motion = plant.begin(TURN, plan)
    assert plant.advance(allow, inf) == {motion: DONE}
    assert plant.observe()["joint_position"].value == pytest.approx(tuple(JOINTS.values()))


def test_only_the_latest_plan_of_this_tick_is_started_and_only_once() -> None:
    plant = Bench()
    stale = MotionCompletion(False, "stale: the decided plan does not start at the current state")
    first, second = plant.plan(TURN), plant.plan(TURN)
    assert plant.begin(TURN, first) == stale
    assert plant.begin(TURN, second) == stale  # a refusal forgets the plan
    third = plant.plan(TURN)
    assert plant.begin(TURN, NoMotion("mine")) == stale
    assert plant.begin(TURN, third) == stale
    fourth = plant.plan(WAIT)
    assert plant.advance(allow, TICK) == {}
    assert plant.begin(WAIT, fourth) == stale
    fifth = plant.plan(WAIT)
    assert plant.begin(WAIT, fifth) == 1
    assert plant.begin(WAIT, fifth) == stale


@pytest.mark.parametrize(
    ("action", "why"),
    [
        (act("whistle"), "unknown kind: `whistle`"),
        (act("look", camera="roof"), "unknown camera: `roof`"),
        (act("look"), "missing parameter: `camera`"),
        (act("look", camera="mast", zoom=2.0), "unknown parameter: `zoom`"),
        (act("wait", duration=-1.0), "out of range: `duration` is outside [0, 600]"),
    ],
)
def test_impossible_requests_are_refused_with_a_reason(action: Action, why: str) -> None:
    plant = Bench()
    assert plant.plan(action) == plant.begin(action) == MotionCompletion(False, why)
    assert plant.begin(action, MotionCompletion(False, "as planned")) == MotionCompletion(False, "as planned")
    assert plant.advance(allow, 0.1) == {}


# Ticks.


def test_time_goes_on_by_whole_ticks_and_never_beyond_until() -> None:
    plant = Bench()
    assert plant.advance(allow, 10.5 * TICK) == {}
    assert plant.ticks == 10
    assert plant.advance(allow, 11.0 * TICK) == {}
    assert plant.ticks == 11
    assert plant.advance(allow, 3.0 * TICK) == {}
    assert plant.ticks == 11


def test_the_monitor_is_called_before_the_first_tick_and_after_every_one() -> None:
    plant = Bench()
    motion = begin(plant, act("wait", duration=3 * TICK))
    times: list[float] = []

    def monitor(now: float, values: Mapping[str, Any]) -> None:
        times.append(now / TICK)
        assert values.keys() == plant._fast_values().keys()

    assert plant.advance(monitor, inf) == {motion: DONE}
    assert times == [0.0, 1.0, 2.0, 3.0]


def test_motions_run_together_and_each_ends_by_itself() -> None:
    plant = Bench()
    slow, fast = begin(plant, act("wait", duration=5 * TICK)), begin(plant, act("wait", duration=2 * TICK))
    assert (slow, fast) == (1, 2)
    assert plant.advance(allow, inf) == {fast: DONE}
    assert plant.ticks == 2
    assert plant.advance(allow, inf) == {slow: DONE}
    assert plant.ticks == 5
    both = [begin(plant, WAIT), begin(plant, WAIT)]
    assert plant.advance(allow, inf) == dict.fromkeys(both, DONE)


def test_a_motion_is_not_commanded_twice_for_one_tick() -> None:
    alone, cut = Bench(), Bench()
    for plant in (alone, cut):
        begin(plant, TURN)
    for number in range(1, 40):
        cut.advance(allow, number * 0.7 * TICK)
    alone.advance(allow, cut.now() + 1e-9)
    assert alone.ticks == cut.ticks
    assert q1(alone) == q1(cut) > 0.0


def test_skills_change_nothing() -> None:
    plant = Bench()
    plant.skill_began("m.s")
    plant.skill_ended("m.s", finished=True)
    assert plant.ticks == 0


# Ends.


def test_a_rule_stops_everything_within_its_tick() -> None:
    plant = Bench()
    motions = [begin(plant, TURN), begin(plant, DRIVE)]
    calls: list[float] = []

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        calls.append(now)
        return "too-near" if now >= 0.2 else None

    ended = plant.advance(monitor, inf)
    assert ended == dict.fromkeys(motions, MotionCompletion(False, "monitor:too-near"))
    # It is asked at every tick of the stop, until the robot is at rest.
    stop = [now for now in calls if now >= 0.2]
    assert stop == pytest.approx([stop[0] + tick * TICK for tick in range(len(stop))])
    assert stop[-1] == plant.now()
    values = plant.observe()
    assert max(map(abs, values["joint_velocity"].value)) == 0.0
    assert values["base_speed"].value == 0.0
    assert 0.0 < q1(plant) < 0.3
    assert plant.advance(allow, plant.now() + 0.1) == {}


def test_a_rule_that_is_broken_at_once_prevents_motion() -> None:
    plant = Bench()
    motion = begin(plant, TURN)
    before = q1(plant)
    ended = plant.advance(lambda now, values: "closed", inf)
    assert ended == {motion: MotionCompletion(False, "monitor:closed")}
    assert q1(plant) == before


def test_a_blocked_motion_ends_all() -> None:
    plant = Bench()
    motions = [begin(plant, TURN), begin(plant, WAIT)]
    plant.blocked_at = 10
    ended = plant.advance(allow, inf)
    assert ended == dict.fromkeys(motions, MotionCompletion(False, "blocked: by a test"))
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0


def test_a_halted_motion_comes_to_rest_within_its_limits_while_others_go_on() -> None:
    plant = Bench()
    turn, drive = begin(plant, TURN), begin(plant, DRIVE)
    plant.advance(allow, 0.3)
    plant.halt(turn)
    plant.blocked_at = 0  # an arm that brakes is not checked for what holds it back
    assert plant.advance(allow, inf) == {turn: MotionCompletion(False, "halted")}
    plant.blocked_at = inf
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0
    assert plant.observe()["base_speed"].value > 0.0
    assert 0.0 < q1(plant) < 0.3
    assert plant.advance(allow, inf) == {drive: DONE}
    assert plant.observe()["base_position"].value == pytest.approx((0.5, 0.0, 0.0))


def test_a_halt_after_set_points_were_sent_lets_them_be_executed() -> None:
    plant = Bench()
    begin(plant, TURN)
    plant.advance(allow, 0.3)
    sent = float(plant.arm.q_command[0])
    assert q1(plant) < sent
    plant.halt(MotionHandle(1))
    assert plant.advance(allow, plant.now() + 1.5 * TICK) == {}
    assert q1(plant) == sent


def test_a_stop_forgets_every_motion() -> None:
    plant = Bench()
    begin(plant, TURN)
    plant.advance(allow, 0.3)
    plant.stop()
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0
    there = q1(plant)
    assert plant.advance(allow, plant.now() + 0.1) == {}
    assert q1(plant) == there
    assert plant.arm.yielded == 1
    motion = begin(plant, WAIT)
    assert plant.advance(allow, inf) == {motion: DONE}


@pytest.mark.parametrize(
    ("force", "ticks", "yields"), [(0.0, 0, 1), (50.0, 0, 1), (51.0, 1, 2), (90.0, 2, 3), (1e9, 120, 121)]
)
def test_a_stop_yields_until_it_presses_with_no_more_than_30_newtons(
    force: float, ticks: int, yields: int
) -> None:
    # Each yielding takes 20 N away, the first one before it looks; after half a second it gives up.
    plant = Bench()
    plant.stop()
    settling = plant.ticks
    plant.arm.yielded, plant.arm.force = 0, force
    plant.stop()
    assert plant.ticks - settling == settling + ticks
    assert plant.arm.yielded == yields


# Pictures.


def test_a_picture_is_observable_after_exposure_with_the_time_it_was_taken() -> None:
    plant = Bench()
    plant.advance(allow, 6 * TICK)
    look = begin(plant, act("look", camera="mast"))
    plan = plant._under_way[look].plan
    assert plan == NoMotion("look: nothing moves")
    plant.advance(allow, plant.now() + (CAMERA_TICKS - 1) * TICK)
    plant.sees = b"can"
    assert plant.pictures() == {}
    assert plant.advance(allow, inf) == {look: DONE}
    assert plant.ticks == 6 + CAMERA_TICKS
    picture = plant.pictures()["mast"]
    assert (picture.rgb, picture.time) == (b"cup", 6 * TICK)


# Measured values.


def test_the_values_of_the_robot_are_complete() -> None:
    plant = Bench()
    plant.arm.force = 7.0
    values = {name: reading.value for name, reading in plant.observe().items()}
    assert values["contact_force"] == 7.0
    assert (values["human_distance"], values["estop_pressed"]) == (20.0, False)
    assert values["finger_gap"] == 0.08
    assert (values["grip_force"], values["tool_speed"], values["link_speed"]) == (0.0, 0.0, 0.0)
    assert values["base_position"] == (0.0, 0.0, 0.0)
    begin(plant, DRIVE)
    plant.advance(allow, 0.5)
    moving = plant.observe()
    assert moving["base_speed"].value == pytest.approx(moving["tool_speed"].value)
    assert moving["link_speed"].value == pytest.approx(moving["base_speed"].value)
    assert moving["base_speed"].value > 0.1

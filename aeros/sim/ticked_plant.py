"""A robot that moves in control ticks, 240 a second, whatever simulates it.

What is here is the same for each such plant: which motions are under way, what is planned and begun, when
the monitor looks, and how everything comes to rest.  A plant says how a tick passes and what is measured.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from math import hypot
from typing import Any, Final

from aeros.runtime.ports import (
    Monitor,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    PlannedMotion,
    Reading,
    Readings,
    Trajectory,
)
from aeros.sim.clock import TICK
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.robot.link_speed import max_link_speed
from aeros.sim.robot.motions import PLANNERS, BlockedError, PreparedMotion, settle
from aeros.sim.robot.parameters import ActionParameters, ActionRejectedError
from aeros.sim.robot.robot import BRAKED_PARTS, Robot, RobotState
from aeros.skill import Action

_CONTACT_FORCE_LIMIT: Final = 30.0
"""Force of contact that a stop leaves at most, if yielding eases it, N: less than half of what injures."""

_YIELD_TICKS: Final = 120
"""Longest time for that, ticks (0.5 s): 600 N against a rigid wall have eased to 60 N then."""

CAMERA_TICKS: Final = 24
"""Exposure and read-out of a camera, ticks (0.1 s)."""


@dataclass
class _RunningMotion:
    """A motion tick by tick, and the parts that it moves.

    plan: what was stated of it; None while it comes to rest.
    is_set: its motors are set for the tick to come.
    """

    ticks: Iterator[None]
    moved_parts: Collection[str]
    plan: PlannedMotion | None = None
    is_commanded: bool = False
    is_halting: bool = False


class TickingPlant(ABC):
    """The part of `aeros.runtime.ports.Plant` that control ticks have in common."""

    def __init__(self, robot: Robot, cameras: Collection[str]) -> None:
        self._robot = robot
        self._cameras = cameras
        self._seen: dict[str, Reading] = {}
        self._state = robot.read_sensors()
        self._planned: tuple[float, PreparedMotion] | None = None
        self._under_way: dict[MotionHandle, _RunningMotion] = {}
        self._begun = 0

    @abstractmethod
    def now(self) -> float:
        """Simulated seconds."""

    @abstractmethod
    def _step_world(self) -> None:
        """Let one tick pass in the world that the robot is in."""

    @abstractmethod
    def _detect(self, camera: str) -> Mapping[str, Any]:
        """What `camera` detects now, by vocabulary name."""

    @abstractmethod
    def _check_tracking(self) -> None:
        """Raise `BlockedError` where something holds arm or carriage back."""

    def plan(self, action: Action) -> PlannedMotion:
        """The motion that `action` is, from here and now."""
        try:
            planned = self._plan(action)
        except ActionRejectedError as refusal:
            return MotionCompletion(False, str(refusal))
        self._planned = (self.now(), planned)
        return planned.plan

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Begin the motion of what was decided, if that is what was planned last, and just now."""
        plan = self.plan(action) if decided is None else decided
        if isinstance(plan, MotionCompletion):
            return plan
        planned, self._planned = self._planned, None
        if planned is None or planned[0] != self.now() or planned[1].plan is not plan:
            return MotionCompletion(
                False, "stale: what was decided is not what was planned from here and now"
            )
        self._begun += 1
        motion = MotionHandle(self._begun)
        self._under_way[motion] = _RunningMotion(planned[1].motion, planned[1].moved_parts, plan)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Tick by tick; `monitor` sees the fast values before the first and after every one.

        Whatever is blocked ends everything: something is where nothing was expected.
        """
        rule = monitor(self.now(), self._monitor_values())
        try:
            while rule is None:
                ended = self._set_motors()
                if ended or self.now() + TICK > until:
                    return ended
                self._tick(
                    stopping=any(
                        one.is_halting and "arm" in one.moved_parts for one in self._running_motions()
                    )
                )
                rule = monitor(self.now(), self._monitor_values())
        except BlockedError as obstacle:
            return self._end_all(str(obstacle))
        return self._end_all(f"monitor:{rule}")

    def halt(self, motion: MotionHandle) -> None:
        """Bring what `motion` moves to rest inside its limits; the fingers keep their grip."""
        one = self._under_way[motion]
        # What the motors are set to already is done first: a set point left out is a jerk.
        self._under_way[motion] = _RunningMotion(
            self._brake(one.moved_parts), one.moved_parts, is_commanded=one.is_commanded, is_halting=True
        )

    def stop(self) -> None:
        """Bring arm and base to rest inside their limits and hold; the fingers keep their grip.

        What is held is where they are then: what is against something stops pushing, an arm that sags stays.
        What still presses, as it was pushed into what it met, is let go back by that.
        """
        if any(one.is_commanded for one in self._running_motions()):
            self._tick(stopping=True)
        self._under_way.clear()
        for _ in self._brake(BRAKED_PARTS):
            self._tick(stopping=True)
        self._robot.yield_to_contact()
        for _ in range(_YIELD_TICKS):
            if self._robot.contact_force() <= _CONTACT_FORCE_LIMIT:
                return
            self._tick(stopping=True)
            self._robot.yield_to_contact()

    def skill_began(self, skill: str) -> None:  # noqa: B027  there is nothing to note
        """A robot does not care who asked."""

    def skill_ended(self, skill: str, *, finished: bool) -> None:  # noqa: B027  there is nothing to note
        """A robot does not care who asked."""

    # Inside.

    def _running_motions(self) -> Collection[_RunningMotion]:
        return self._under_way.values()

    def _set_motors(self) -> dict[MotionHandle, MotionCompletion]:
        """Set each motor for the tick to come, once; those motions that are at their end."""
        ended = {}
        for motion, one in self._under_way.items():
            if one.is_commanded:
                continue
            try:
                next(one.ticks)
            except StopIteration:
                ended[motion] = (
                    MotionCompletion(False, "halted") if one.is_halting else MotionCompletion(True)
                )
            else:
                one.is_commanded = True
        for motion in ended:
            del self._under_way[motion]
        return ended

    def _end_all(self, why: str) -> dict[MotionHandle, MotionCompletion]:
        """Everything under way, over."""
        motions = list(self._under_way)
        self.stop()
        return dict.fromkeys(motions, MotionCompletion(False, why))

    def _brake(self, parts: Collection[str]) -> Iterator[None]:
        yield from self._robot.brake(parts)
        yield from settle(self._robot)

    def _plan(self, action: Action) -> PreparedMotion:
        parameters = ActionParameters(action.parameters)
        if action.kind == "look":
            camera = parameters.string("camera")
            parameters.reject_unread()
            if camera not in self._cameras:
                raise ActionRejectedError(f"unknown camera: `{camera}`")
            return PreparedMotion(NoMotion("it takes a picture"), self._camera_motion(camera))
        planner = PLANNERS.get(action.kind)
        if planner is None:
            raise ActionRejectedError(f"unknown kind: `{action.kind}`")
        return planner(self._robot, parameters, self._base_trajectory())

    def _base_trajectory(self) -> Trajectory | None:
        """What was stated of the motion of the base under way."""
        plans = [one.plan for one in self._running_motions() if "base" in one.moved_parts]
        return next((plan for plan in plans if isinstance(plan, Trajectory)), None)

    def _camera_motion(self, camera: str) -> Iterator[None]:
        """Take a picture, hand over what it shows once it is read out."""
        found, taken = self._detect(camera), self.now()
        for _ in range(CAMERA_TICKS):
            yield
        self._publish_detection({name: Reading(value, taken) for name, value in found.items()})

    def _publish_detection(self, picture: Readings) -> None:
        """Let be observed what a picture shows; None: what was seen before is not there any more."""
        self._seen.update(picture)
        for name in [name for name, one in picture.items() if one.value is None]:
            del self._seen[name]

    def _tick(self, *, stopping: bool = False) -> None:
        self._step_world()
        self._state = self._robot.read_sensors()
        self._measure()
        for one in self._running_motions():
            one.is_commanded = False
        if not stopping:
            self._check_tracking()

    def _monitor_values(self) -> Mapping[str, Any]:
        """What the monitor gets to see of this tick."""
        return self._fast_values()

    def _measure(self) -> None:  # noqa: B027  a plant may
        """Measure what is true after this tick; here everything is measured as it is, when asked for."""

    def _fast_values(self) -> dict[str, Any]:
        """What is true of the robot and people around it, by vocabulary name, SI, positions in W."""
        state: RobotState = self._state
        return {
            "joint_position": state.q,
            "joint_velocity": state.qd,
            "joint_torque": state.torque,
            "tool_position": state.tool_position,
            "tool_speed": state.tool_speed,
            "link_speed": max_link_speed(state.q, state.qd, state.base_velocity),
            "contact_force": self._robot.contact_force(),
            "finger_gap": state.finger_gap,
            "grip_force": min(self._robot.finger_forces()),
            "human_distance": SCANNER_RANGE,
            "estop_pressed": False,
            "base_position": state.base_position,
            "base_speed": hypot(*state.base_velocity),
        }

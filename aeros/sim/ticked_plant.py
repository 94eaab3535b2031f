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

from aeros.runtime.ports import Completion, Monitor, Motion, Motionless, Plan, Reading, Readings, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.robot.link_speed import link_speed
from aeros.sim.robot.motions import PLANNERS, BlockedError, Planned, settle
from aeros.sim.robot.parameters import Parameters, RefusedError
from aeros.sim.robot.robot import PARTS, Robot, RobotState
from aeros.skill import Action

_EASED: Final = 30.0
"""Force of contact that a stop leaves at most, if yielding eases it, N: less than half of what injures."""

_EASING_TICKS: Final = 120
"""Longest time for that, ticks (0.5 s): 600 N against a rigid wall have eased to 60 N then."""

LOOK_TICKS: Final = 24
"""Exposure and read-out of a camera, ticks (0.1 s)."""


@dataclass
class _UnderWay:
    """A motion tick by tick, and the parts that it moves.

    plan: what was stated of it; None while it comes to rest.
    is_set: its motors are set for the tick to come.
    """

    ticks: Iterator[None]
    moves: Collection[str]
    plan: Plan | None = None
    is_set: bool = False
    is_halting: bool = False


class TickingPlant(ABC):
    """The part of `aeros.runtime.ports.Plant` that control ticks have in common."""

    def __init__(self, robot: Robot, cameras: Collection[str]) -> None:
        self._robot = robot
        self._cameras = cameras
        self._seen: dict[str, Reading] = {}
        self._state = robot.sense()
        self._planned: tuple[float, Planned] | None = None
        self._under_way: dict[Motion, _UnderWay] = {}
        self._begun = 0

    @abstractmethod
    def now(self) -> float:
        """Simulated seconds."""

    @abstractmethod
    def _pass_tick(self) -> None:
        """Let one tick pass in the world that the robot is in."""

    @abstractmethod
    def _see(self, camera: str) -> Mapping[str, Any]:
        """What `camera` detects now, by vocabulary name."""

    @abstractmethod
    def _check_tracking(self) -> None:
        """Raise `BlockedError` where something holds arm or carriage back."""

    def plan(self, action: Action) -> Plan:
        """The motion that `action` is, from here and now."""
        try:
            planned = self._plan(action)
        except RefusedError as refusal:
            return Completion(False, str(refusal))
        self._planned = (self.now(), planned)
        return planned.plan

    def begin(self, action: Action, decided: Plan | None = None) -> Motion | Completion:
        """Begin the motion of what was decided, if that is what was planned last, and just now."""
        plan = self.plan(action) if decided is None else decided
        if isinstance(plan, Completion):
            return plan
        planned, self._planned = self._planned, None
        if planned is None or planned[0] != self.now() or planned[1].plan is not plan:
            return Completion(False, "stale: what was decided is not what was planned from here and now")
        self._begun += 1
        motion = Motion(self._begun)
        self._under_way[motion] = _UnderWay(planned[1].motion, planned[1].moves, plan)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[Motion, Completion]:
        """Tick by tick; `monitor` sees the fast values before the first and after every one.

        Whatever is blocked ends everything: something is where nothing was expected.
        """
        rule = monitor(self.now(), self._monitored())
        try:
            while rule is None:
                ended = self._set_motors()
                if ended or self.now() + TICK > until:
                    return ended
                self._tick(stopping=any(one.is_halting and "arm" in one.moves for one in self._all()))
                rule = monitor(self.now(), self._monitored())
        except BlockedError as obstacle:
            return self._stopped(str(obstacle))
        return self._stopped(f"monitor:{rule}")

    def halt(self, motion: Motion) -> None:
        """Bring what `motion` moves to rest inside its limits; the fingers keep their grip."""
        one = self._under_way[motion]
        # What the motors are set to already is done first: a set point left out is a jerk.
        self._under_way[motion] = _UnderWay(
            self._coming_to_rest(one.moves), one.moves, is_set=one.is_set, is_halting=True
        )

    def stop(self) -> None:
        """Bring arm and base to rest inside their limits and hold; the fingers keep their grip.

        What is held is where they are then: what is against something stops pushing, an arm that sags stays.
        What still presses, as it was pushed into what it met, is let go back by that.
        """
        if any(one.is_set for one in self._all()):
            self._tick(stopping=True)
        self._under_way.clear()
        for _ in self._coming_to_rest(PARTS):
            self._tick(stopping=True)
        self._robot.yield_here()
        for _ in range(_EASING_TICKS):
            if self._robot.contact_force() <= _EASED:
                return
            self._tick(stopping=True)
            self._robot.yield_here()

    def skill_began(self, skill: str) -> None:  # noqa: B027  there is nothing to note
        """A robot does not care who asked."""

    def skill_ended(self, skill: str, *, finished: bool) -> None:  # noqa: B027  there is nothing to note
        """A robot does not care who asked."""

    # Inside.

    def _all(self) -> Collection[_UnderWay]:
        return self._under_way.values()

    def _set_motors(self) -> dict[Motion, Completion]:
        """Set each motor for the tick to come, once; those motions that are at their end."""
        ended = {}
        for motion, one in self._under_way.items():
            if one.is_set:
                continue
            try:
                next(one.ticks)
            except StopIteration:
                ended[motion] = Completion(False, "halted") if one.is_halting else Completion(True)
            else:
                one.is_set = True
        for motion in ended:
            del self._under_way[motion]
        return ended

    def _stopped(self, why: str) -> dict[Motion, Completion]:
        """Everything under way, over."""
        motions = list(self._under_way)
        self.stop()
        return dict.fromkeys(motions, Completion(False, why))

    def _coming_to_rest(self, parts: Collection[str]) -> Iterator[None]:
        yield from self._robot.stopping(parts)
        yield from settle(self._robot)

    def _plan(self, action: Action) -> Planned:
        parameters = Parameters(action.parameters)
        if action.kind == "look":
            camera = parameters.word("camera")
            parameters.done()
            if camera not in self._cameras:
                raise RefusedError(f"unknown camera: `{camera}`")
            return Planned(Motionless("it takes a picture"), self._look(camera))
        planner = PLANNERS.get(action.kind)
        if planner is None:
            raise RefusedError(f"unknown kind: `{action.kind}`")
        return planner(self._robot, parameters, self._drive())

    def _drive(self) -> Trajectory | None:
        """What was stated of the motion of the base under way."""
        plans = [one.plan for one in self._all() if "base" in one.moves]
        return next((plan for plan in plans if isinstance(plan, Trajectory)), None)

    def _look(self, camera: str) -> Iterator[None]:
        """Take a picture, hand over what it shows once it is read out."""
        found, taken = self._see(camera), self.now()
        for _ in range(LOOK_TICKS):
            yield
        self._show({name: Reading(value, taken) for name, value in found.items()})

    def _show(self, picture: Readings) -> None:
        """Let be observed what a picture shows; None: what was seen before is not there any more."""
        self._seen.update(picture)
        for name in [name for name, one in picture.items() if one.value is None]:
            del self._seen[name]

    def _tick(self, *, stopping: bool = False) -> None:
        self._pass_tick()
        self._state = self._robot.sense()
        self._measure()
        for one in self._all():
            one.is_set = False
        if not stopping:
            self._check_tracking()

    def _monitored(self) -> Mapping[str, Any]:
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
            "link_speed": link_speed(state.q, state.qd, state.base_velocity),
            "contact_force": self._robot.contact_force(),
            "finger_gap": state.finger_gap,
            "grip_force": min(self._robot.finger_forces()),
            "human_distance": SCANNER_RANGE,
            "estop_pressed": False,
            "base_position": state.base_position,
            "base_speed": hypot(*state.base_velocity),
        }

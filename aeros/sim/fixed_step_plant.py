"""The base class of simulated robots that move in control ticks, 240 a second.

It keeps what all such plants share: the motions under way, planning and beginning, calling the monitor, and
coming to rest. A subclass says how the world steps and what is measured.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import hypot, pi
from typing import Any, ClassVar, Final

from aeros.runtime.ports import (
    BACK_OFF,
    CameraPicture,
    Monitor,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    PlannedMotion,
    Trajectory,
    announce_stop,
)
from aeros.sim.clock import TICK
from aeros.sim.robot.errors import ActionRejectedError, BlockedError
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.robot.motions import (
    ActionParameters,
    PreparedMotion,
    plan_base_lines,
    plan_grip,
    plan_move_base,
    plan_move_joints,
    plan_move_tool,
    plan_stop,
    plan_tool_lines,
    plan_wait,
)
from aeros.sim.robot.robot import BRAKED_PARTS, Robot, RobotState, braking_link_speed
from aeros.sim.robot.slide import plan_slide
from aeros.skill import Action
from aeros.spec.model.rules import SIMULATED_ACTIONS

_CONTACT_FORCE_LIMIT: Final = 30.0
"""Contact force at which a stop no longer needs to yield, N: less than half of what injures."""

_YIELD_TICKS: Final = 120
"""Longest time of yielding after a stop that does not back off, ticks (0.5 s)."""

_WAY_TICKS: Final = 240
"""Length of the way that is remembered to back off along it, ticks (1 s)."""

_BACK_OFF_SPEED: Final = 0.1
"""Speed of backing off: of the fastest joint, rad/s, or of the base, m/s."""

TORQUE_CUTOFF: Final = 30.0
"""Cut-off frequency of the first-order filter of torques, of which the rate is taken, Hz. Drivers filter,
too (libfranka: 100 Hz by default). Chosen: fingers that close on a fixed bar change a torque by 6 N·m."""

_TORQUE_SHARE: Final = TICK / (TICK + 1.0 / (2.0 * pi * TORQUE_CUTOFF))

CAMERA_TICKS: Final = 24
"""Exposure and read-out of a camera, ticks (0.1 s)."""


PictureSource = Callable[[], CameraPicture]
"""Returns a picture of the moment at which it was taken, whenever it is called."""

_SEQUENCES: Final = {"move_tool": plan_tool_lines, "move_base": plan_base_lines}

_PLANNERS: Final[dict[str, Callable[[Robot, ActionParameters, Trajectory | None], PreparedMotion]]] = {
    "stop": plan_stop,
    "wait": plan_wait,
    "move_tool": plan_move_tool,
    "move_joints": plan_move_joints,
    "grip": plan_grip,
    "slide": plan_slide,
    "move_base": plan_move_base,
}
"""Motion planners by action kind; the plant itself handles `look`, which moves nothing."""


@dataclass
class _RunningMotion:
    """A motion under way and the parts of the robot that it moves.

    Attributes:
        ticks: sets the motors for one tick at each step.
        moved_parts: of `arm` and `base`.
        plan: the plan it was begun with; None while it comes to rest.
        is_commanded: its motors are set for the coming tick.
        is_halting: it is coming to rest.
    """

    ticks: Iterator[None]
    moved_parts: Collection[str]
    plan: PlannedMotion | None = None
    is_commanded: bool = False
    is_halting: bool = False


class _FilteredTorques:
    """Joint torques through a first-order filter, Nm, and their rates, Nm/s.

    Args:
        torques: at the start.
    """

    def __init__(self, torques: Sequence[float]) -> None:
        self._torques = list(torques)
        self.rates: tuple[float, ...] = (0.0,) * len(torques)

    def update(self, torques: Sequence[float]) -> None:
        """Take in the torques of a tick."""
        changes = [a - b for a, b in zip(torques, self._torques, strict=True)]
        self._torques = [b + _TORQUE_SHARE * d for b, d in zip(self._torques, changes, strict=True)]
        self.rates = tuple([_TORQUE_SHARE / TICK * change for change in changes])


class FixedStepPlant(ABC):
    """The part of `aeros.runtime.ports.Plant` that simulators with control ticks share.

    Args:
        robot: the simulated robot; the attribute `body` is its body, as plans state it.
        cameras: names of the cameras that `look` accepts.
    """

    def __init__(self, robot: Robot, cameras: Collection[str]) -> None:
        self._robot, self._cameras, self.body = robot, cameras, robot.model.body
        self._pictures: dict[str, PictureSource] = {}
        self._state = robot.read_sensors()
        self._filtered = _FilteredTorques(self._state.torque)
        self._planned: tuple[float, PreparedMotion] | None = None
        self._under_way: dict[MotionHandle, _RunningMotion] = {}
        self._motion_count = 0
        self._way: deque[RobotState] = deque(maxlen=_WAY_TICKS)

    @abstractmethod
    def now(self) -> float:
        """Implement `Plant.now`: simulated seconds."""

    @abstractmethod
    def _step_world(self) -> None:
        """Advance the world around the robot by one tick."""

    @abstractmethod
    def _look(self, camera: str) -> PictureSource:
        """Take a picture with `camera` now."""

    @abstractmethod
    def _check_tracking(self) -> None:
        """Raise `BlockedError` if something holds arm or carriage back."""

    action_kinds: ClassVar = frozenset(SIMULATED_ACTIONS)
    """The action kinds that it can do, for sites with other words; see `Plant`."""

    def pictures(self) -> Mapping[str, CameraPicture]:
        """Return the newest picture of each camera: those of `look`, and the first ones of the scene.

        Returns:
            The pictures by camera; a camera that has taken none is absent.
        """
        return {name: source() for name, source in self._pictures.items()}

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan` for the current state."""
        try:
            planned = self._plan(action)
        except ActionRejectedError as refusal:
            return MotionCompletion(False, str(refusal))
        self._planned = (self.now(), planned)
        return planned.plan

    def plan_sequence(self, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
        """Plan `move_tool` or `move_base` actions one after the other; see `ports.plan_sequence`.

        Args:
            actions: the actions.

        Returns:
            A plan for each; None if they are of several kinds or of another one, or something moves.
        """
        kinds = {action.kind for action in actions}
        plan = _SEQUENCES.get(min(kinds)) if len(kinds) == 1 else None
        if self._under_way or plan is None:
            return None
        return plan(self._robot, [ActionParameters(action.parameters) for action in actions])

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`; refuses a plan that is not the latest one or was not made at this time."""
        plan = self.plan(action) if decided is None else decided
        if isinstance(plan, MotionCompletion):
            return plan
        planned, self._planned = self._planned, None
        if planned is None or planned[0] != self.now() or planned[1].plan is not plan:
            return MotionCompletion(False, "stale: the decided plan does not start at the current state")
        self._motion_count += 1
        motion = MotionHandle(self._motion_count)
        self._under_way[motion] = _RunningMotion(planned[1].motion, planned[1].moved_parts, plan)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance` tick by tick.

        A blocked motion ends all motions: something is where nothing was expected.
        """
        rule = monitor(self.now(), self._monitor_values())
        try:
            while rule is None:
                ended = self._set_motors()
                if ended or self.now() + TICK > until:
                    return ended
                self._tick(
                    stopping=any(
                        running.is_halting and "arm" in running.moved_parts
                        for running in self._running_motions()
                    )
                )
                rule = monitor(self.now(), self._monitor_values())
        except BlockedError as obstacle:
            if not any(running.is_commanded for running in self._running_motions()):
                monitor(self.now(), self._monitor_values())  # of the tick in which it was noticed
            announce_stop(monitor, str(obstacle), self.now())
            return self._end_all(str(obstacle), monitor)
        return self._end_all(f"monitor:{rule}", monitor)

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`; the fingers keep their grip."""
        running = self._under_way[motion]
        # Set points already sent are executed first: skipping one would be a jerk.
        self._under_way[motion] = _RunningMotion(
            chain(self._brake(running.moved_parts), self._robot.settle()),
            running.moved_parts,
            is_commanded=running.is_commanded,
            is_halting=True,
        )

    def stop(self) -> None:
        """Implement `Plant.stop`: bring arm and base to rest inside their limits and hold; keep the grip.

        The robot holds its measured position: it stops pushing against an obstacle, and an arm that sags
        stays where it is. If it still presses on something, it goes compliant for up to 0.5 s so that the
        contact force falls to 30 N.
        """
        self._come_to_rest(lambda: None)

    def skill_began(self, skill: str) -> None:  # noqa: B027  there is nothing to note
        """Implement `Plant.skill_began`: nothing to do."""

    def skill_ended(self, skill: str, *, finished: bool) -> None:  # noqa: B027  there is nothing to note
        """Implement `Plant.skill_ended`: nothing to do."""

    # Internals.

    def _running_motions(self) -> Collection[_RunningMotion]:
        return self._under_way.values()

    def _set_motors(self) -> dict[MotionHandle, MotionCompletion]:
        """Set the motors of each motion for the coming tick, once; return the motions that have ended."""
        ended = {}
        for motion, running in self._under_way.items():
            if running.is_commanded:
                continue
            try:
                next(running.ticks)
            except StopIteration:
                ended[motion] = (
                    MotionCompletion(False, "halted") if running.is_halting else MotionCompletion(True)
                )
            else:
                running.is_commanded = True
        for motion in ended:
            del self._under_way[motion]
        return ended

    def _end_all(self, why: str, monitor: Monitor) -> dict[MotionHandle, MotionCompletion]:
        """Stop the robot, back off while `monitor` allows it, and end every motion with reason `why`."""
        motions = list(self._under_way)
        self._come_to_rest(lambda: monitor(self.now(), self._monitor_values()))
        return dict.fromkeys(motions, MotionCompletion(False, why))

    def _come_to_rest(self, ask: Callable[[], str | None]) -> None:
        """Brake, back off while the answer is `BACK_OFF`, and hold; `ask` is called after every tick."""
        answer: str | None = None
        for _ in chain(self._stop_motions(), [None]):
            self._tick(stopping=True)
            answer = ask()
        if answer == BACK_OFF:
            self._robot.yield_to_contact()
            for _ in self._back_off():
                self._tick(stopping=True)
                if ask() != BACK_OFF:
                    break
            for _ in self._brake(BRAKED_PARTS):
                self._tick(stopping=True)
                ask()
        for _ in self._robot.settle():
            self._tick(stopping=True)
            ask()
        self._robot.yield_to_contact()
        for _ in range(_YIELD_TICKS):
            if self._robot.contact_force() <= _CONTACT_FORCE_LIMIT:
                return
            self._tick(stopping=True)
            ask()
            self._robot.yield_to_contact()

    def _stop_motions(self) -> Iterator[None]:
        """Brake everything, after the set points that were already sent; yields once per tick."""
        if any(running.is_commanded for running in self._running_motions()):
            yield
        self._under_way.clear()
        yield from self._brake(BRAKED_PARTS)

    def _back_off(self) -> Iterator[None]:
        """Move back along the way that the robot came, at `_BACK_OFF_SPEED`; yields once per tick."""
        way = list(self._way)
        self._way.clear()
        yield from self._robot.retrace(reversed(way), _BACK_OFF_SPEED)

    def _brake(self, parts: Collection[str]) -> Iterator[None]:
        yield from self._robot.brake(parts)

    def _plan(self, action: Action) -> PreparedMotion:
        parameters = ActionParameters(action.parameters)
        if action.kind == "look":
            camera = parameters.string("camera")
            parameters.reject_unread()
            if camera not in self._cameras:
                raise ActionRejectedError(f"unknown camera: `{camera}`")
            return PreparedMotion(NoMotion("look: nothing moves"), self._camera_motion(camera))
        planner = _PLANNERS.get(action.kind)
        if planner is None:
            raise ActionRejectedError(f"unknown kind: `{action.kind}`")
        return planner(self._robot, parameters, self._base_trajectory())

    def _base_trajectory(self) -> Trajectory | None:
        """Return the plan of the base motion under way, if there is one."""
        plans = [running.plan for running in self._running_motions() if "base" in running.moved_parts]
        return next((plan for plan in plans if isinstance(plan, Trajectory)), None)

    def _camera_motion(self, camera: str) -> Iterator[None]:
        """Take a picture; publish it after exposure and read-out."""
        picture = self._look(camera)
        for _ in range(CAMERA_TICKS):
            yield
        self._pictures[camera] = picture

    def _tick(self, *, stopping: bool = False) -> None:
        self._step_world()
        self._state = self._robot.read_sensors()
        self._filtered.update(self._state.torque)
        self._way.append(self._state)
        self._measure()
        for running in self._running_motions():
            running.is_commanded = False
        if not stopping:
            self._check_tracking()

    def _monitor_values(self) -> Mapping[str, Any]:
        """Return the values that the monitor sees at this tick."""
        return self._fast_values()

    def _measure(self) -> None:  # noqa: B027  a plant may
        """Measure the ground truth of this tick; a no-op here, as values are exact and read on request."""

    def _fast_values(self) -> dict[str, Any]:
        """Return the ground truth of robot and people around it, by vocabulary name, SI, positions in W."""
        return _robot_values(self._robot, self._state, self._filtered.rates)


def _robot_values(robot: Robot, state: RobotState, torque_rates: tuple[float, ...]) -> dict[str, Any]:
    """Return the ground truth of a robot that nobody is near, by vocabulary name; rates are in N·m/s."""
    return {
        "joint_position": state.q,
        "joint_velocity": state.qd,
        "joint_torque": state.torque,
        "joint_torque_rate": torque_rates,
        "tool_position": state.tool_position,
        "tool_speed": state.tool_speed,
        "link_speed": braking_link_speed(robot.model, state.q, state.qd, state.base_velocity),
        "tracking_error": robot.tracking_distance(state),
        "contact_force": robot.contact_force(),
        "finger_gap": state.finger_gap,
        "grip_force": min(robot.finger_forces()),
        "human_distance": SCANNER_RANGE,
        "estop_pressed": False,
        "base_position": state.base_position,
        "base_speed": hypot(*state.base_velocity),
    }

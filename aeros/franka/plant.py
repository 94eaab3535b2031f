"""The plant `franka`: decided motions on a real Franka Research 3.

The arm is driven by a process of its own (`streamer`), the hand by another one (`hand_loop`). This module
plans, hands decided motions over, and calls the monitor for every state that the robot reports, a thousand a
second. Plant time is the robot's clock at the newest state that was read here; the robot moves on meanwhile.
The process of the arm brakes by itself when the states that the monitor has judged are too old.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Final

from aeros.franka.arm import CYCLE, MODES, REFLEX
from aeros.franka.arm_client import ArmClient, RobotGoneError
from aeros.franka.hand_client import HandClient
from aeros.franka.measurements import Measurements
from aeros.franka.process import ProcessError
from aeros.franka.settings import FrankaSettings
from aeros.franka.standing_robot import StandingRobot
from aeros.runtime.ports import (
    Monitor,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Reading,
    Readings,
    Trajectory,
    Vec3,
    announce_stop,
)
from aeros.sim.robot.errors import ActionRejectedError
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.motions import (
    JOINT_ARRIVAL_TOLERANCE,
    ActionParameters,
    plan_grip,
    plan_move_joints,
    plan_move_tool,
    plan_stop,
    plan_tool_lines,
    plan_wait,
)
from aeros.skill import Action

_PLANNERS: Final = {
    "stop": plan_stop,
    "wait": plan_wait,
    "move_tool": plan_move_tool,
    "move_joints": plan_move_joints,
    "grip": plan_grip,
}

_REST_SPEED: Final = 0.01
"""Joint speed below which the arm rests, rad/s, as on the simulators."""

_SETTLE_TIME: Final = 0.25
"""Longest time in which the arm comes to rest after its set points do, s."""

_READY_MODES: Final = frozenset((MODES.index("idle"), MODES.index("move")))


@dataclass
class _Motion:
    """A motion under way.

    Attributes:
        action: its action.
        plan: its plan.
        begun: plant time at which it began, s; None before the first `advance` after `begin`.
        is_halting: it is coming to rest.
    """

    action: Action
    plan: PlannedMotion
    begun: float | None = None
    is_halting: bool = False


class FrankaPlant:
    """Implementation of `aeros.runtime.ports.Plant`.

    Args:
        settings: of the robot.
        model: the robot.
        base: position of the arm's base in W, m.
        declared: names of the site's state variables.

    Raises:
        ProcessError: the robot cannot be reached, or it is not ready to move.
    """

    runs_in_real_time: ClassVar = True
    action_kinds: ClassVar = frozenset(_PLANNERS)

    def __init__(
        self, settings: FrankaSettings, model: RobotModel, base: Vec3, declared: Collection[str]
    ) -> None:
        self._robot = StandingRobot(model, base)
        self._start_tolerance = settings.start_tolerance
        self._measurements = Measurements(model, base, declared)
        self._declared = frozenset(declared)
        self._motions: dict[MotionHandle, _Motion] = {}
        self._count = 0
        self._planned: PlannedMotion | None = None
        self._values: Mapping[str, Any] = {}
        self._hand: HandClient | None = None
        self._arm = ArmClient(_arm_settings(settings, model))
        try:
            self._arm.refresh()
            self._take_state()
            self._require_ready()
            if settings.has_hand:
                self._hand = HandClient(settings.address, model.hand.finger_speed)
        except (ProcessError, RobotGoneError) as failure:
            self.close()
            raise ProcessError(str(failure)) from failure

    @property
    def cycle_times(self) -> Mapping[str, float]:
        """Times of the cycles of the last motion: `streamer.CycleTimes.summary`."""
        return self._arm.cycle_times

    @property
    def arm_process(self) -> int:
        """Number of the process that drives the arm."""
        return self._arm.pid

    # The port.

    def now(self) -> float:
        """Implement `Plant.now`: the robot's clock at the newest state that was read."""
        return self._arm.state.time

    def observe(self) -> Readings:
        """Implement `Plant.observe`: of the newest state; while nothing moves, it is asked for anew."""
        if not self._motions and not self._arm.is_streaming:
            if self._arm.refresh():
                self._take_state()
            if self._hand is not None:
                self._hand.refresh(self.now())
        time = self.now()
        readings = {name: Reading(value, time) for name, value in self._values.items()}
        return {**readings, **self._hand_readings()}

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan` for the position that the arm is commanded to."""
        try:
            planned = self._plan(action)
        except ActionRejectedError as refusal:
            return MotionCompletion(False, str(refusal))
        self._planned = planned
        return planned

    def plan_sequence(self, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
        """Plan `move_tool` actions one after the other; see `ports.plan_sequence`.

        Args:
            actions: the actions.

        Returns:
            A plan for each; None if they are of another kind, or something moves.
        """
        if self._motions or {action.kind for action in actions} != {"move_tool"}:
            return None
        return plan_tool_lines(self._robot, [ActionParameters(action.parameters) for action in actions])

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`; refuses a plan that is not the latest one, or starts somewhere else."""
        plan = self.plan(action) if decided is None else decided
        if isinstance(plan, MotionCompletion):
            return plan
        planned, self._planned = self._planned, None
        refusal = None if plan is planned else "stale: it is not the plan that was made last"
        refusal = refusal or self._refusal_to_begin(action, plan)
        if refusal is not None:
            return MotionCompletion(False, refusal)
        self._count += 1
        motion = MotionHandle(self._count)
        self._motions[motion] = _Motion(action, plan)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`, state by state."""
        if not self._arm.is_streaming and self._arm.refresh():
            self._take_state()
        self._arm.watch(on=True)
        rule = monitor(self.now(), self._monitor_values())
        if rule is None:
            self._begin_pending()
        try:
            while rule is None and self._own_stop() is None:
                ended = self._collect_ended()
                if ended or self.now() + CYCLE > until:
                    if not self._motions:
                        self._arm.watch(on=False)
                    return ended
                if self._next_state():
                    rule = monitor(self.now(), self._monitor_values())
                    self._arm.acknowledge()
        except RobotGoneError as failure:
            if not self._motions:
                raise
            return self._end_all(f"gone: {failure}", monitor)
        return self._end_all(self._own_stop() if rule is None else f"monitor:{rule}", monitor)

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`; fingers that move go on to their end."""
        running = self._motions[motion]
        running.is_halting = True
        if isinstance(running.plan, Trajectory) and running.begun is not None:
            self._arm.brake()

    def stop(self) -> None:
        """Implement `Plant.stop`: brake on the decided path, then hold; the fingers keep their grip."""
        self._come_to_rest(lambda time, values: None)
        self._motions.clear()

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`: nothing to do."""

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`: nothing to do."""

    def close(self) -> None:
        """Implement `Plant.close`: the arm brakes and holds."""
        self._motions.clear()
        self._arm.close()
        if self._hand is not None:
            self._hand.close()

    # Internals.

    def _take_state(self) -> None:
        self._values = self._measurements.take(self._arm.state)
        if not self._arm.is_streaming:
            self._robot.stand(self._arm.state)

    def _next_state(self) -> bool:
        """Wait for the next message of the robot; return True if it is a state."""
        is_state = self._arm.wait()
        if is_state:
            self._take_state()
            if self._hand is not None:
                self._hand.poll(self.now())
        return is_state

    def _hand_readings(self) -> dict[str, Reading]:
        if self._hand is None:
            return {}
        readings = self._hand.readings()
        return {name: one for name, one in readings.items() if name in self._declared}

    def _monitor_values(self) -> Mapping[str, Any]:
        return {**self._values, **self._hand_readings()}

    def _plan(self, action: Action) -> PlannedMotion:
        refusal = self._mode_refusal()
        if refusal is not None:
            raise ActionRejectedError(refusal)
        planner = _PLANNERS.get(action.kind)
        if planner is None:
            raise ActionRejectedError(f"unknown kind: `{action.kind}`")
        if action.kind == "grip" and self._hand is None:
            raise ActionRejectedError("unknown kind: `grip` on an arm without a hand")
        return planner(self._robot, ActionParameters(action.parameters), None).plan

    def _require_ready(self) -> None:
        """Raise `ProcessError` if the robot does not move in its mode."""
        refusal = self._mode_refusal()
        if refusal is not None:
            raise ProcessError(refusal)

    def _mode_refusal(self) -> str | None:
        """Return why the robot does not move in its mode, or None."""
        mode = self._arm.state.mode
        if mode in _READY_MODES:
            return None
        if mode == REFLEX:
            return (
                "reflex: the robot has stopped by itself and does not move until a person has looked; then "
                "`python -m aeros.franka.recover` clears it"
            )
        return f"not ready: the robot's mode is {MODES[mode] if mode < len(MODES) else mode}"

    def _refusal_to_begin(self, action: Action, plan: PlannedMotion) -> str | None:
        if isinstance(plan, Trajectory):
            if any(isinstance(one.plan, Trajectory) for one in self._motions.values()):
                return "busy: the arm moves already"
            away = max(
                abs(a - b) for a, b in zip(self._robot.q_command, plan.joint_paths[0][0][0], strict=True)
            )
            if away > self._start_tolerance:
                return f"stale: the plan starts {away:.4f} rad from where the arm is commanded"
        if action.kind == "grip" and self._hand is not None:
            self._hand.poll(self.now())
            if self._hand.is_busy:
                return "busy: the fingers move already"
        return None

    def _begin_pending(self) -> None:
        """Start what was begun since the last call."""
        for running in self._motions.values():
            if running.begun is not None or running.is_halting:
                continue
            running.begun = self.now()
            if isinstance(running.plan, Trajectory):
                self._arm.start(running.plan)
            elif running.action.kind == "grip" and self._hand is not None:
                self._hand.grip(*(float(running.action.parameters[name]) for name in ("width", "force")))
            elif running.action.kind == "stop":
                self._arm.brake()

    def _own_stop(self) -> str | None:
        """Return why the arm stops, or has stopped, without having been told to; None if it does not."""
        if self._arm.own_stop is not None:
            return self._arm.own_stop
        end = self._arm.end
        if end is None or not any(self._is_arm_motion(one) for one in self._motions.values()):
            return None
        return end.reason

    @staticmethod
    def _is_arm_motion(running: _Motion) -> bool:
        return isinstance(running.plan, Trajectory) and running.begun is not None

    def _collect_ended(self) -> dict[MotionHandle, MotionCompletion]:
        """Return the motions that have ended, and forget them."""
        ended = {}
        for motion, running in self._motions.items():
            completion = self._completion(running)
            if completion is not None:
                ended[motion] = completion
        for motion in ended:
            del self._motions[motion]
        return ended

    def _completion(self, running: _Motion) -> MotionCompletion | None:
        """Return how a motion has ended; None if it has not."""
        if running.begun is None:
            return MotionCompletion(False, "halted") if running.is_halting else None
        if isinstance(running.plan, Trajectory):
            return self._arm_completion(running, running.plan)
        if running.is_halting:
            return MotionCompletion(False, "halted")
        if running.action.kind == "wait":
            is_over = self.now() >= running.begun + float(running.action.parameters["duration"])
            return MotionCompletion(True) if is_over else None
        if running.action.kind == "grip" and self._hand is not None:
            if self._hand.is_busy:
                return None
            failure = self._hand.failure
            return MotionCompletion(True) if failure is None else MotionCompletion(False, f"hand: {failure}")
        return MotionCompletion(True)

    def _arm_completion(self, running: _Motion, plan: Trajectory) -> MotionCompletion | None:
        end = self._arm.end
        if end is None or not self._is_at_rest():
            return None
        if running.is_halting or end.is_braked:
            return MotionCompletion(False, "halted")
        miss = max(abs(a - b) for a, b in zip(self._arm.state.q, plan.joint_paths[0][-1][3], strict=True))
        if miss > JOINT_ARRIVAL_TOLERANCE:
            return MotionCompletion(False, f"blocked: a joint stopped {miss:.3f} rad from its target")
        return MotionCompletion(True)

    def _is_at_rest(self) -> bool:
        """Return True if a state after the last set point shows that the arm rests, or time is up."""
        since = self.now() - self._arm.ended_at
        return since > _SETTLE_TIME or (since > 0.0 and max(map(abs, self._arm.state.dq)) < _REST_SPEED)

    def _end_all(self, why: str | None, monitor: Monitor) -> dict[MotionHandle, MotionCompletion]:
        """Bring the arm to rest, and end every motion with reason `why`."""
        reason = why or "stopped"
        if not reason.startswith("monitor:"):
            announce_stop(monitor, reason, self.now())
        motions = list(self._motions)
        try:
            self._come_to_rest(monitor)
        except RobotGoneError as failure:
            reason = reason if reason.startswith(("gone:", "monitor:")) else f"{reason}; gone: {failure}"
        self._motions.clear()
        return dict.fromkeys(motions, MotionCompletion(False, reason))

    def _come_to_rest(self, monitor: Monitor) -> None:
        """Brake, and wait until the arm rests; the monitor is called for every state."""
        self._arm.brake()
        while self._arm.is_streaming or not self._is_at_rest():
            if self._next_state():
                monitor(self.now(), self._monitor_values())
        self._arm.watch(on=False)
        self._robot.stand(self._arm.state)


def _arm_settings(settings: FrankaSettings, model: RobotModel) -> dict[str, Any]:
    """Return what the process of the arm needs to know, as JSON values."""
    return {
        "address": settings.address,
        "real_time": settings.is_real_time,
        "torques": settings.torques,
        "forces": settings.forces,
        "acceleration": model.limits.acceleration.tolist(),
        "jerk": model.limits.jerk.tolist(),
        "patience": settings.patience,
        "start_tolerance": settings.start_tolerance,
    }

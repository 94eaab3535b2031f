"""The loop that drives the controller: one goal for a decided motion, and a goal that brakes it on its path.

It runs in a process of its own. It decides nothing. It hands a decided motion over as one trajectory, sends
the joint states to the plant, and brakes that motion

- when the plant tells it to, as a rule is broken or a motion is halted;
- by itself, when the joint states stop or come late by more than `patience`;
- by itself, when the monitor has judged nothing for `patience`;
- by itself, when the plant's end of the link is closed.

To brake is to send a goal whose points leave the path nowhere and end at rest. If the controller does not
accept that goal, or somebody else has replaced the motion, all its goals are cancelled, and it holds at once.
So they are if a goal ends otherwise than it should, or is accepted after it was cancelled.

If this process dies in mid-motion, the controller goes on to the end of the decided motion.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from aeros.ros2_control.commanded_joints import CommandedJoints
from aeros.ros2_control.controller import (
    ControllerError,
    GoalEvent,
    GoalState,
    JointSample,
    TrajectoryController,
    TrajectoryGoal,
)
from aeros.ros2_control.controller_clock import ControllerClock
from aeros.ros2_control.points import braking_points, decided_points
from aeros.wired_arm.arm import MODES, ArmState, Joints
from aeros.wired_arm.link import JudgedMessage, LinkClosedError, ProcessLink, StartMessage, StateMessage
from aeros.wired_arm.streamed_motion import StreamedMotion

_POLL: Final = 0.004
"""Longest time until messages of the plant are read, s."""

_START_LEAD: Final = 0.1
"""Time from sending a goal to the start of its trajectory, s; chosen: the controller accepts it meanwhile."""

_BRAKE_LEAD: Final = 0.04
"""Time from sending a brake goal to the beginning of its braking, s; chosen."""

_ANSWER_TIMEOUT: Final = 0.2
"""Longest time until a brake goal is accepted, s; chosen: then all goals are cancelled."""

_EARLIEST_SUCCESS: Final = 0.1
"""Time before the last point from which a success is believed, s; chosen: errors of the clock are smaller."""

SETTLE_TIME: Final = 1.0
"""Longest time after the last point until the joints are at the goal, s; chosen."""

_ENDS: Final = {
    GoalState.REJECTED: "refused: the controller rejected the motion",
    GoalState.PREEMPTED: "preempted: another client replaced the motion; all goals are cancelled",
    GoalState.FAILED: "controller: it ended the motion by itself",
}
"""Reasons of motions that the controller did not execute."""

_IDLE_MODE: Final = MODES.index("idle")


class LoopLimits(NamedTuple):
    """Limits of the loop.

    Attributes:
        acceleration: limit of each joint, rad/s².
        jerk: limit of each joint, rad/s³.
        patience: longest time without joint states, or without a judgement of the monitor, s.
        start_tolerance: greatest distance of a motion's start from where the joints are commanded, rad.
        path_tolerance: error of each joint at which the controller itself ends a motion, rad.
        goal_tolerance: greatest error of a joint at the end, rad.
    """

    acceleration: tuple[float, ...]
    jerk: tuple[float, ...]
    patience: float
    start_tolerance: float
    path_tolerance: tuple[float, ...]
    goal_tolerance: float


@dataclass
class _Run:
    """A motion that the controller executes.

    goal: number of the newest goal. start: of the trajectory, on the controller's clock, s. judged: plant
    time of the newest state that the monitor has judged, s. deadline: time until which the controller must
    have ended the goal, s. braked_at: time of the motion at which braking begins, s. sent: when the newest
    goal was sent, on the controller's clock, s. held_goals: those that the controller has accepted and not
    ended.
    """

    motion: StreamedMotion
    goal: int
    start: float
    judged: float
    deadline: float
    is_shown: bool = False
    is_accepted: bool = False
    held_goals: set[int] = field(default_factory=set)
    is_cancelled: bool = False
    is_braking: bool = False
    braked_at: float | None = None
    sent: float = 0.0
    reason: str | None = None

    @property
    def rest(self) -> float:
        """Time of the newest goal's last point, on the controller's clock, s."""
        lasts = self.motion.duration
        return self.start + (lasts if self.braked_at is None else self.braked_at + self.motion.braking_time)

    def position(self, now: float) -> Joints:
        elapsed = now - self.start
        if self.braked_at is None or elapsed <= self.braked_at:
            return self.motion.position(elapsed)
        return self.motion.braked_position(self.braked_at, elapsed - self.braked_at)


class TrajectoryLoop:
    """The loop.

    Args:
        controller: the controller.
        link: to the plant.
        limits: of the robot and of the site.
        clock: returns monotonic time, s.
    """

    def __init__(
        self,
        controller: TrajectoryController,
        link: ProcessLink,
        limits: LoopLimits,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._controller = controller
        self._link = link
        self._limits = limits
        self._monotonic = clock
        self._clock = ControllerClock(limits.patience)
        self._newest: JointSample | None = None
        self._commanded = CommandedJoints(limits.start_tolerance)
        self._run: _Run | None = None
        self._shift = 0.0
        """Time for which the plant's clock has stood, while the controller took motions over, s."""
        self._time = 0.0
        """Plant time of the newest state that was sent, s."""
        self._wants_state = self._is_watched = self._is_over = False

    def run(self) -> None:
        """Drive the controller until the plant closes the link, or the controller is gone."""
        try:
            while self._run is not None or not self._is_over:
                self.turn()
        except LinkClosedError:
            return
        except ControllerError as failure:
            self._controller.cancel_all()
            with suppress(LinkClosedError):
                self._link.report("gone", reason=str(failure))
        except Exception as failure:
            self._controller.cancel_all()
            with suppress(LinkClosedError):
                what = f"{type(failure).__name__}: {failure}"
                self._link.report(
                    "gone", reason=f"the process of the controller failed and cancelled all goals: {what}"
                )
            raise

    def turn(self) -> None:
        """Take the next joint states, obey the plant, and look after the motion.

        Raises:
            LinkClosedError: the plant is gone, and nothing moves.
            ControllerError: the controller does not answer.
        """
        sample = self._controller.next_sample(_POLL)
        try:
            if sample is not None:
                self._take(sample)
            while (message := self._link.receive()) is not None:
                if isinstance(message, StartMessage):
                    self._start(message)
                elif isinstance(message, JudgedMessage):
                    self._note_judgement(message.time)
                elif isinstance(message, dict):
                    self._obey(message)
        except LinkClosedError as failure:
            if self._run is None:
                raise
            self._is_watched = self._wants_state = False
            self._brake(f"left alone: {failure}")
        while (happened := self._controller.next_event()) is not None:
            self._take_event(happened)
        if self._run is not None:
            self._supervise(self._run)

    # Messages of the plant.

    def _obey(self, message: dict[str, Any]) -> None:
        kind = message["is"]
        if kind == "read":
            self._wants_state = True
        elif kind == "watch":
            self._is_watched = bool(message["on"])
        elif kind == "brake":
            self._brake(None)
        elif kind == "close":
            self._is_over = True
            self._brake("left alone: the plant was closed")

    def _note_judgement(self, time: float) -> None:
        if self._run is not None:
            self._run.judged = max(self._run.judged, time)

    def _start(self, order: StartMessage) -> None:
        """Send a motion to the controller, or say why not."""
        motion = StreamedMotion(order.path, order.duration, self._limits.acceleration, self._limits.jerk)
        now = self._now()
        refusal = self._start_refusal(motion)
        if refusal is not None:
            self._link.report("ended", reason=refusal, braked=False)
            return
        motion.begin_at(self._commanded.at(motion.start))
        start = now + _START_LEAD
        goal = self._send(start, motion, None)
        deadline = start + motion.duration + SETTLE_TIME + self._limits.patience
        self._run = _Run(motion, goal, start, self._time, deadline, sent=now)

    def _start_refusal(self, motion: StreamedMotion) -> str | None:
        age = self._clock.age(self._monotonic())
        if age > self._limits.patience:
            return f"late: no joint states for {1000.0 * age:.0f} ms; nothing has begun"
        if self._run is not None:
            return "busy: the arm moves already"
        return self._commanded.stale_refusal(motion.start)

    # Joint states.

    def _take(self, sample: JointSample) -> None:
        """Take joint states, and send them to the plant unless a motion is just being handed over."""
        if not self._clock.note(sample.stamp, sample.arrival):
            return
        self._newest = sample
        run = self._run
        if run is None:
            self._commanded.stand(sample.q)
        elif not run.is_shown:
            if sample.stamp < run.start:
                return
            # The monitor compares with the motion from the plant time at which it was begun.
            run.is_shown = True
            self._shift = run.start - self._time
        if self._is_watched or self._wants_state or run is not None:
            self._wants_state = False
            self._time = max(self._time, sample.stamp - self._shift)
            if not self._link.send(StateMessage(self._state(sample), run is not None)) and run is not None:
                self._brake("late: the plant does not read the joint states")

    def _state(self, sample: JointSample) -> ArmState:
        run, still = self._run, (0.0,) * len(sample.q)
        commanded = self._commanded.at(sample.q) if run is None else run.position(sample.stamp)
        return ArmState(
            self._time, sample.q, sample.dq, commanded, sample.effort or still, still, _IDLE_MODE, 1.0
        )

    # The motion.

    def _send(self, start: float, motion: StreamedMotion, braked_at: float | None) -> int:
        points = decided_points(motion) if braked_at is None else braking_points(motion, braked_at)
        tolerances = self._limits.path_tolerance, self._limits.goal_tolerance
        return self._controller.send(TrajectoryGoal(start, points, *tolerances, SETTLE_TIME))

    def _brake(self, reason: str | None) -> None:
        """Brake the motion under way, once, for a reason if nobody has told this loop to."""
        run = self._run
        if run is None:
            return
        if reason is not None and run.reason is None:
            run.reason = reason
            with suppress(LinkClosedError):
                self._link.report("braking", reason=reason)
        if run.is_braking:
            return
        run.is_braking = True
        now = self._now()
        braked_at = now + _BRAKE_LEAD - run.start
        if braked_at <= 0.0 or not run.is_accepted:
            self._cancel(run)  # The arm may still stand at the start, where no brake goal may lead it away.
        elif braked_at < run.motion.duration:
            run.braked_at = braked_at
            run.is_accepted, run.sent = False, now
            run.goal = self._send(run.start, run.motion, braked_at)
            run.deadline = run.rest + SETTLE_TIME + self._limits.patience

    def _cancel(self, run: _Run) -> None:
        if not run.is_cancelled:
            run.is_cancelled = True
            run.deadline = self._now() + SETTLE_TIME
            self._controller.cancel_all()

    def _take_event(self, happened: GoalEvent) -> None:
        run = self._run
        if happened.state is GoalState.ACCEPTED and (run is None or run.is_cancelled):
            self._controller.cancel_all()  # The cancellation has overtaken this goal.
        if run is None:
            return
        if happened.state is GoalState.ACCEPTED:
            run.held_goals.add(happened.number)
            run.is_accepted = run.is_accepted or happened.number == run.goal
            return
        run.held_goals.discard(happened.number)
        if happened.number == run.goal and not run.is_cancelled:
            self._take_end(run, happened)
        if run.is_cancelled and not run.held_goals:
            self._commanded.place = None
            self._end(run, run.reason)

    def _take_end(self, run: _Run, happened: GoalEvent) -> None:
        """Take the end of the newest goal; that of a goal which a brake goal has replaced does not count."""
        if happened.state is GoalState.SUCCEEDED and self._now() >= run.rest - _EARLIEST_SUCCESS:
            self._commanded.place = run.position(run.deadline)
            self._end(run, run.reason)
        elif happened.state is GoalState.SUCCEEDED:
            run.reason = run.reason or "controller: it reports a success before the end of the motion"
            self._cancel(run)
        elif happened.state is GoalState.REJECTED and run.braked_at is not None:
            run.reason = run.reason or f"held: the brake goal was refused, {happened.reason}"
            self._cancel(run)
        else:
            if happened.state is not GoalState.REJECTED:
                self._controller.cancel_all()  # Another client moves it, or nobody knows that it holds.
            self._commanded.place = None
            self._end(run, run.reason or f"{_ENDS[happened.state]}: {happened.reason}")

    def _supervise(self, run: _Run) -> None:
        """Brake or cancel a motion whose states, judgements or answers do not come.

        Raises:
            ControllerError: the controller does not end a goal that was cancelled.
        """
        now, patience = self._now(), self._limits.patience
        age = self._clock.age(self._monotonic())
        if age > patience:
            self._brake(f"late: no joint states for {1000.0 * age:.0f} ms")
        late = self._time - run.judged
        if run.is_shown and late > patience:
            self._brake(f"late: the monitor has judged nothing for {1000.0 * late:.0f} ms")
        if run.is_braking and not run.is_accepted and now > run.sent + _ANSWER_TIMEOUT:
            run.reason = run.reason or "held: the brake goal was not answered"
            self._cancel(run)
        if now > run.deadline:
            if run.is_cancelled:
                raise ControllerError("the controller does not answer: a goal was cancelled and does not end")
            run.is_braking = True
            run.reason = run.reason or "late: the controller does not say how the motion has ended"
            self._cancel(run)

    def _end(self, run: _Run, reason: str | None) -> None:
        self._run = None
        self._is_over = self._is_over or (reason or "").startswith("left alone")
        try:
            self._link.report("ended", reason=reason, braked=run.is_braking)
        except LinkClosedError:
            self._is_over = True

    def _now(self) -> float:
        return self._clock.read(self._monotonic())

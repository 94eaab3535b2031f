"""The loop that drives the arm: a thousand times a second a state in, a set point out.

It runs in a process of its own. It decides nothing: it streams one decided motion, and it brakes that motion

- when the plant tells it to, as a rule is broken or a motion is halted;
- by itself, when the monitor has judged no state for `patience` on the robot's clock: it is late or
  hangs;
- by itself, when the plant's end of the link is closed;
- by itself, when the program fails in mid-motion.

If this process dies in mid-motion, the robot gets no commands, and stops by itself after 20 cycles.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from aeros.franka.arm import Arm, ControlledArm
from aeros.wired_arm.arm import CYCLE, ArmError, ArmState, Joints
from aeros.wired_arm.link import JudgedMessage, LinkClosedError, ProcessLink, StartMessage, StateMessage
from aeros.wired_arm.streamed_motion import StreamedMotion


class CycleTimes:
    """Times of the cycles of one motion, on the wall clock, and the cycles that were lost.

    Attributes:
        cycles: states that were answered.
        lost: cycles of the robot's clock between two states, whose commands did not come in time.
    """

    def __init__(self) -> None:
        self.cycles = 0
        self.lost = 0
        self._answers: list[float] = []
        self._gaps: list[float] = []
        self._last: float | None = None

    def note_state(self, elapsed: float) -> float:
        """Note that a state has come.

        Args:
            elapsed: time on the robot's clock since the state before, s.

        Returns:
            The time on the wall clock, s.
        """
        now = time.perf_counter()
        if self._last is not None:
            self._gaps.append(now - self._last)
            self.lost += max(0, round(elapsed / CYCLE) - 1)
        self._last = now
        self.cycles += 1
        return now

    def note_answer(self, since: float) -> None:
        """Note that a set point was written.

        Args:
            since: the wall clock when the state came, s.
        """
        self._answers.append(time.perf_counter() - since)

    def summary(self) -> dict[str, float]:
        """Summarise the times.

        Returns:
            Numbers of cycles; median, 99th percentile and greatest time between states, and from a state to
            its answer, s.
        """
        numbers: dict[str, float] = {"cycles": self.cycles, "lost": self.lost}
        for name, values in (("gap", sorted(self._gaps)), ("answer", sorted(self._answers))):
            for label, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0)):
                if values:
                    numbers[f"{name}_{label}"] = values[min(len(values) - 1, int(share * len(values)))]
        return numbers


class Streamer:
    """The loop.

    Args:
        arm: the arm.
        link: to the plant.
        acceleration: limit of each joint, rad/s².
        jerk: limit of each joint, rad/s³.
        patience: longest time on the robot's clock for which a motion goes on without a judgement, s.
        start_tolerance: greatest distance of a motion's start from the commanded joints, rad; it fades out.
    """

    def __init__(
        self,
        arm: Arm,
        link: ProcessLink,
        acceleration: Sequence[float],
        jerk: Sequence[float],
        patience: float,
        start_tolerance: float,
    ) -> None:
        self._arm, self._link = arm, link
        self._limits = acceleration, jerk
        self._patience = patience
        self._start_tolerance = start_tolerance
        self._judged = 0.0
        self._commanded: float | None = None
        """Time of the state that was answered last, s; None before the first one."""
        self._wants_state = False
        self._is_watched = False
        self._is_over = False

    def run(self) -> None:
        """Drive the arm until the plant closes the link, or the robot is gone."""
        try:
            while not self._is_over:
                self._idle()
        except LinkClosedError:
            return
        except ArmError as failure:
            with suppress(LinkClosedError):
                self._link.report("gone", reason=str(failure))
        except Exception as failure:
            with suppress(LinkClosedError):
                what = f"{type(failure).__name__}: {failure}"
                self._link.report(
                    "gone", reason=f"the streaming process failed and has stopped the arm: {what}"
                )
            raise

    def _idle(self) -> None:
        """Read one state, and do what the plant asks for."""
        state = self._arm.read()
        if (self._is_watched or self._wants_state) and self._link.send(StateMessage(state, False)):
            self._wants_state = False
        while (message := self._link.receive()) is not None:
            if isinstance(message, StartMessage):
                self._run_motion(message)
                return
            if isinstance(message, dict):
                self._obey(message)

    def _obey(self, message: dict[str, Any]) -> None:
        kind = message["is"]
        if kind == "read":
            self._wants_state = True
        elif kind == "watch":
            self._is_watched = bool(message["on"])
        elif kind == "close":
            self._is_over = True

    def _run_motion(self, start: StartMessage) -> None:
        """Stream a motion, and say how it ended."""
        motion = StreamedMotion(start.path, start.duration, *self._limits)
        times, reason, self._commanded = CycleTimes(), None, None
        try:
            control = self._arm.start()
            try:
                reason = self._stream(control, motion, times)
            except ArmError:
                raise
            except BaseException:
                self._stop_alone(control, motion)
                raise
        except ArmError as failure:
            reason = str(failure)
            if not failure.is_connected:
                raise
        if motion.is_braking or reason is not None:
            # What the robot still does, it ends now. It refuses this if it stands already.
            with suppress(ArmError):
                self._arm.stop()
        self._link.report("ended", reason=reason, braked=motion.is_braking, **times.summary())

    def _stream(self, control: ControlledArm, motion: StreamedMotion, times: CycleTimes) -> str | None:
        """Stream set points until the arm rests; return why it braked by itself, or None."""
        state = control.read()
        refusal = self._start_refusal(state, motion.start)
        if refusal is not None:
            control.write(state.q_d, is_last=True)
            return refusal
        motion.begin_at(state.q_d)
        self._judged, reason, elapsed = state.time, None, CYCLE
        since = times.note_state(elapsed)
        while True:
            try:
                must_brake = self._exchange(state)
                late = state.time - self._judged
                if not motion.is_braking and not must_brake and late > self._patience + CYCLE / 2.0:
                    unjudged = f"{1000.0 * late:.0f} ms of the robot's clock"
                    reason = f"late: the monitor has judged nothing for {unjudged}"
                    must_brake = True
                    self._link.report("braking", reason=reason)
            except LinkClosedError as failure:
                if not motion.is_braking:
                    reason = f"left alone: {failure}"
                must_brake = self._is_over = True
            if must_brake:
                motion.brake()
            q, is_last = motion.step(elapsed)
            control.write(q, is_last=is_last)
            self._commanded = state.time
            times.note_answer(since)
            if is_last:
                return reason
            before = state.time
            state = control.read()
            elapsed = state.time - before
            since = times.note_state(elapsed)

    def _stop_alone(self, control: ControlledArm, motion: StreamedMotion) -> None:
        """Brake without the plant, as this program has failed; in any case, the robot stops then."""
        try:
            motion.brake()
            is_last = False
            while not is_last:
                now = control.read().time
                elapsed = CYCLE if self._commanded is None else now - self._commanded
                q, is_last = motion.step(elapsed)
                control.write(q, is_last=is_last)
                self._commanded = now
        except ArmError:
            pass  # The robot has stopped by itself, or is gone; the failure of this program is reported.
        finally:
            with suppress(ArmError):
                self._arm.stop()

    def _exchange(self, state: ArmState) -> bool:
        """Send a state and read what has come; return True if the arm must brake."""
        must_brake = not self._link.send(StateMessage(state, True))
        while (message := self._link.receive()) is not None:
            if isinstance(message, JudgedMessage):
                self._judged = max(self._judged, message.time)
            elif isinstance(message, dict):
                must_brake = must_brake or message["is"] in ("brake", "close")
                self._obey(message)
        return must_brake

    def _start_refusal(self, state: ArmState, start: Joints) -> str | None:
        """Return why a motion cannot begin here, or None."""
        away = max(abs(a - b) for a, b in zip(state.q_d, start, strict=True))
        if away <= self._start_tolerance:
            return None
        return f"stale: the motion begins {away:.6f} rad from where the arm is commanded"

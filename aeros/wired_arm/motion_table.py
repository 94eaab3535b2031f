"""Motions under way on the real robot: which began, and how each has ended."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import Final

from aeros.kinematic_chain import position_unit
from aeros.runtime.ports import MotionCompletion, MotionHandle, PlannedMotion, PlantLostError, Trajectory
from aeros.sim.robot.motions import JOINT_ARRIVAL_TOLERANCE
from aeros.skill import Action
from aeros.wired_arm.arm_client import ArmClient
from aeros.wired_arm.hand_client import HandClient

_REST_SPEED: Final = 0.01
"""Joint speed below which the arm rests, rad/s, as on the simulators."""

SETTLE_TIME: Final = 1.0
"""Longest time in which the arm comes to rest after its set points do, s; chosen."""

FINGER_TIME: Final = 5.0
"""Longest time in which the fingers come to rest, s; chosen: they go their whole way in one."""


class RestlessError(PlantLostError):
    """The robot was told to stop, and does not come to rest; the message says what moves."""


@dataclass
class RunningMotion:
    """A motion under way.

    Attributes:
        action: its action.
        plan: its plan.
        began: plant time at which it began, s; None before the first `advance` after `begin`.
        is_halting: it is coming to rest.
    """

    action: Action
    plan: PlannedMotion
    began: float | None = None
    is_halting: bool = False

    @property
    def moves_arm(self) -> bool:
        """True if it moves the arm, and has begun to."""
        return isinstance(self.plan, Trajectory) and self.began is not None


class MotionTable:
    """Table of the motions under way.

    Args:
        arm: the arm.
        hand: the hand; None without one.
    """

    def __init__(self, arm: ArmClient, hand: HandClient | None) -> None:
        self._arm, self._hand = arm, hand
        self._motions: dict[MotionHandle, RunningMotion] = {}
        self._count = 0

    def __len__(self) -> int:
        return len(self._motions)

    def add(self, action: Action, plan: PlannedMotion) -> MotionHandle:
        """Add a motion, which begins with the next call of `begin_pending`.

        Args:
            action: its action.
            plan: its plan.

        Returns:
            Its number.
        """
        self._count += 1
        motion = MotionHandle(self._count)
        self._motions[motion] = RunningMotion(action, plan)
        return motion

    def busy_refusal(self, action: Action, plan: PlannedMotion) -> str | None:
        """Say why a motion cannot begin beside those under way.

        Args:
            action: its action.
            plan: its plan.

        Returns:
            The reason; None if it can.
        """
        if isinstance(plan, Trajectory) and any(
            isinstance(one.plan, Trajectory) for one in self._motions.values()
        ):
            return "busy: the arm moves already"
        if action.kind == "grip" and self._hand is not None:
            self._hand.poll(self._arm.state.time)
            if self._hand.is_busy:
                return "busy: the fingers move already"
        return None

    def begin_pending(self) -> None:
        """Start what was added since the last call."""
        for running in self._motions.values():
            if running.began is not None or running.is_halting:
                continue
            running.began = self._arm.state.time
            if isinstance(running.plan, Trajectory):
                self._arm.start(running.plan)
            elif running.action.kind == "grip" and self._hand is not None:
                self._hand.grip(*(float(running.action.parameters[name]) for name in ("width", "force")))
            elif running.action.kind == "stop":
                self._arm.brake()

    def halt(self, motion: MotionHandle) -> None:
        """Halt a motion; fingers that move go on to their end, and the motion ends with them.

        Args:
            motion: its number.
        """
        running = self._motions[motion]
        running.is_halting = True
        if running.moves_arm:
            self._arm.brake()

    def own_stop(self) -> str | None:
        """Say why the arm stops, or has stopped, without having been told to.

        Returns:
            The reason; None if it does not.
        """
        if not any(one.moves_arm for one in self._motions.values()):
            return None
        if self._arm.own_stop is not None:
            return self._arm.own_stop
        return None if self._arm.end is None else self._arm.end.reason

    def collect_ended(self) -> dict[MotionHandle, MotionCompletion]:
        """Remove the motions that have ended.

        Returns:
            Their ends.
        """
        ended = {}
        for motion, running in self._motions.items():
            completion = self._completion(running)
            if completion is not None:
                ended[motion] = completion
        for motion in ended:
            del self._motions[motion]
        return ended

    def end_all(self, reason: str) -> dict[MotionHandle, MotionCompletion]:
        """Remove all motions.

        Args:
            reason: why they end.

        Returns:
            Their ends.
        """
        ended = dict.fromkeys(self._motions, MotionCompletion(False, reason))
        self._motions.clear()
        return ended

    def is_arm_at_rest(self) -> bool:
        """Return True if a state after the last set point shows that the arm rests.

        Returns:
            True if it rests.
        """
        state = self._arm.state
        return state.time > self._arm.ended_at and max(map(abs, state.dq)) < _REST_SPEED

    def unrest(self, waited: float) -> str | None:
        """Say what still moves after everything was told to stop.

        Args:
            waited: time since the last set point of the arm, s.

        Returns:
            What moves for longer than it may; empty if something moves and may, None if all rests.
        """
        if not self.is_arm_at_rest():
            return self._unrest_of_arm(waited)
        if self._hand is not None and self._hand.is_busy:
            return f"the fingers still move after {waited:.2g} s" if waited > FINGER_TIME else ""
        return None

    def _completion(self, running: RunningMotion) -> MotionCompletion | None:
        """Return how a motion has ended; None if it has not."""
        if running.began is None:
            return MotionCompletion(False, "halted") if running.is_halting else None
        if isinstance(running.plan, Trajectory):
            return self._arm_completion(running, running.plan)
        if running.action.kind == "grip" and self._hand is not None and self._hand.is_busy:
            return None
        if running.is_halting:
            return MotionCompletion(False, "halted")
        if running.action.kind == "wait":
            until = running.began + float(running.action.parameters["duration"])
            return MotionCompletion(True) if self._arm.state.time >= until else None
        if running.action.kind == "grip" and self._hand is not None:
            failure = self._hand.failure
            return MotionCompletion(True) if failure is None else MotionCompletion(False, f"hand: {failure}")
        return MotionCompletion(True)

    def _arm_completion(self, running: RunningMotion, plan: Trajectory) -> MotionCompletion | None:
        end = self._arm.end
        if end is None:
            return None
        if not self.is_arm_at_rest():
            unrest = self._unrest_of_arm(self._arm.state.time - self._arm.ended_at)
            return MotionCompletion(False, f"moving: {unrest}") if unrest else None
        if running.is_halting or end.is_braked:
            return MotionCompletion(False, "halted")
        ways = [abs(a - b) for a, b in zip(self._arm.state.q, plan.joint_paths[0][-1][3], strict=True)]
        miss, row = max(zip(ways, plan.body.dh_rows, strict=True), key=itemgetter(0))
        if miss > JOINT_ARRIVAL_TOLERANCE:
            unit = position_unit(row)
            return MotionCompletion(False, f"blocked: a joint stopped {miss:.3f} {unit} from its target")
        return MotionCompletion(True)

    def _unrest_of_arm(self, waited: float) -> str:
        speed = max(map(abs, self._arm.state.dq))
        return (
            f"a joint still moves at {speed:.3f} rad/s or m/s after {waited:.2g} s"
            if waited > SETTLE_TIME
            else ""
        )

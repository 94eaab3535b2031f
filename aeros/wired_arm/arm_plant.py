"""Plant of an arm that a process of its own drives along decided motions, as `ArmClient` sees it.

This module plans, hands decided motions over, and calls the monitor for every state that the process
reports. Plant time is the time of the newest state that was read here; the robot moves on meanwhile. The
process brakes by itself when the states that the monitor has judged are too old.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar

from aeros.runtime.ports import (
    Monitor,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Reading,
    Readings,
    RobotBody,
    Trajectory,
    announce_stop,
)
from aeros.skill import Action
from aeros.wired_arm.arm import CYCLE
from aeros.wired_arm.arm_client import ArmClient, RobotLostError
from aeros.wired_arm.hand_client import HandClient
from aeros.wired_arm.measurements import Measurements
from aeros.wired_arm.motion_table import MotionTable, RestlessError
from aeros.wired_arm.planner import PLANNERS, MotionPlanner


class ArmPlant:
    """Implementation of `aeros.runtime.ports.Plant`.

    Args:
        arm: the arm; it is closed with the plant.
        planner: of its motions.
        measurements: of its states.
        declared: names of the site's state variables.

    Raises:
        RobotLostError: the arm reports no state.
    """

    runs_in_real_time: ClassVar = True
    action_kinds: ClassVar = frozenset(PLANNERS)

    def __init__(
        self, arm: ArmClient, planner: MotionPlanner, measurements: Measurements, declared: Collection[str]
    ) -> None:
        self._arm, self._planner, self._measurements = arm, planner, measurements
        self._declared = frozenset(declared)
        self._planned: PlannedMotion | None = None
        self._values: Mapping[str, Any] = {}
        self._period = CYCLE
        """Longest time to be expected until the next state, s."""
        self._hand: HandClient | None = None
        self._arm.refresh()
        self._take_state()
        self._motions = MotionTable(self._arm, None)

    @property
    def arm_process(self) -> int:
        """Number of the process that drives the arm."""
        return self._arm.pid

    # The port.

    @property
    def body(self) -> RobotBody:
        """The robot's body, as plans state it."""
        return self._planner.body

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
        plan = self._planner.plan(action, self._arm.state.mode, has_hand=self._hand is not None)
        self._planned = None if isinstance(plan, MotionCompletion) else plan
        return plan

    def plan_sequence(self, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
        """Plan `move_tool` actions one after the other; see `ports.plan_sequence`.

        Args:
            actions: the actions.

        Returns:
            A plan for each; None if they are of another kind, or something moves.
        """
        if self._motions or {action.kind for action in actions} != {"move_tool"}:
            return None
        return self._planner.plan_lines(actions)

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`; refuses a plan that is not the latest one, or starts somewhere else."""
        plan = self.plan(action) if decided is None else decided
        if isinstance(plan, MotionCompletion):
            return plan
        planned, self._planned = self._planned, None
        refusal = None if plan is planned else "stale: it is not the plan that was made last"
        refusal = refusal or self._motions.busy_refusal(action, plan)
        if refusal is None and isinstance(plan, Trajectory):
            refusal = self._planner.stale_refusal(plan)
        return self._motions.add(action, plan) if refusal is None else MotionCompletion(False, refusal)

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`, state by state."""
        if not self._arm.is_streaming and self._arm.refresh():
            self._take_state()
        self._arm.watch(on=True)
        rule = monitor(self.now(), self._monitor_values())
        if rule is None:
            self._motions.begin_pending()
        try:
            while rule is None and self._motions.own_stop() is None:
                ended = self._motions.collect_ended()
                if ended or self.now() + self._period > until:
                    if not self._motions:
                        self._arm.watch(on=False)
                    return ended
                if self._next_state():
                    rule = monitor(self.now(), self._monitor_values())
                    self._arm.acknowledge()
        except RobotLostError as failure:
            if not self._motions:
                raise
            return self._end_all(f"gone: {failure}", monitor)
        return self._end_all(self._motions.own_stop() if rule is None else f"monitor:{rule}", monitor)

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`; fingers that move go on to their end, and only then the motion ends."""
        self._motions.halt(motion)

    def stop(self) -> None:
        """Implement `Plant.stop`: brake on the decided path, then hold; the fingers keep their grip.

        Fingers that move go on to their end, with the force of their command, and this waits for them: the
        library lets no other thread call `Gripper.stop` meanwhile.

        Raises:
            RestlessError: arm or fingers do not come to rest.
            RobotLostError: the robot cannot be reached.
        """
        self._come_to_rest(lambda time, values: None)
        self._motions.end_all("stopped")

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`: nothing to do."""

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`: nothing to do."""

    def close(self) -> None:
        """Implement `Plant.close`: the arm brakes and holds."""
        self._arm.close()
        if self._hand is not None:
            self._hand.close()

    # Internals.

    def _take_state(self) -> None:
        self._values = self._measurements.take(self._arm.state)
        if not self._arm.is_streaming:
            self._planner.stand(self._arm.state)

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

    def _end_all(self, why: str | None, monitor: Monitor) -> dict[MotionHandle, MotionCompletion]:
        """Bring the arm to rest, and end every motion with reason `why`."""
        reason = why or "stopped"
        if not reason.startswith("monitor:"):
            announce_stop(monitor, reason, self.now())
        try:
            self._come_to_rest(monitor)
        except RestlessError as failure:
            reason = f"moving: {failure}; told to stop by {reason}"
        except RobotLostError as failure:
            reason = reason if reason.startswith(("gone:", "monitor:")) else f"{reason}; gone: {failure}"
        return self._motions.end_all(reason)

    def _come_to_rest(self, monitor: Monitor) -> None:
        """Brake, and wait until arm and fingers rest; the monitor is called for every state.

        Raises:
            RestlessError: they do not.
        """
        self._arm.brake()
        since = self.now()
        while self._arm.is_streaming or (unrest := self._motions.unrest(self.now() - since)) is not None:
            if self._arm.is_streaming:
                since = self.now()
            elif unrest:
                raise RestlessError(unrest)
            self._arm.watch(on=True)
            if self._next_state():
                monitor(self.now(), self._monitor_values())
        self._arm.watch(on=False)
        self._planner.stand(self._arm.state)

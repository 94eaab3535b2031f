"""A controller for the tests of the loop: it follows exactly, on a clock that the tests move."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from aeros.ros2_control.controller import GoalEvent, GoalState, JointSample, TrajectoryGoal
from aeros.ros2_control.trajectory_loop import LoopLimits, TrajectoryLoop
from aeros.wired_arm.link import Message, ProcessLink
from tests.unit.franka.stub.arms import ACCELERATION, JERK, READY

PERIOD = 0.01
"""Time between joint states, s."""

OFFSET = 1000.0
"""The controller's clock is ahead of the monotonic one by this, s."""

LIMITS = LoopLimits(ACCELERATION, JERK, 0.1, 0.003, (0.02,) * 7, 0.01)


class ScriptedController:
    """A controller whose joints are where its newest trajectory has them.

    `answers` are the first events of goals, by number; others are accepted and succeed at their end.
    """

    def __init__(self) -> None:
        self.time = 0.0
        self.q = READY
        self.goals: list[TrajectoryGoal] = []
        self.answers: dict[int, GoalEvent | None] = {}
        self.cancellations = 0
        self.is_silent = False
        self.is_deaf = False
        self.active: int | None = None
        self.events: deque[GoalEvent] = deque()

    def monotonic(self) -> float:
        return self.time

    def next_sample(self, timeout: float) -> JointSample | None:
        self.time += PERIOD
        now = self.time + OFFSET
        if self.active is not None:
            goal = self.goals[self.active - 1]
            past = [point for point in goal.points if goal.start + point.time <= now]
            if past:
                self.q = past[-1].q
            if len(past) == len(goal.points):
                self.events.append(GoalEvent(self.active, GoalState.SUCCEEDED))
                self.active = None
        if self.is_silent:
            return None
        return JointSample(now, self.time, self.q, (0.0,) * 7, ())

    def next_event(self) -> GoalEvent | None:
        return self.events.popleft() if self.events else None

    def send(self, goal: TrajectoryGoal) -> int:
        self.goals.append(goal)
        number = len(self.goals)
        answer = self.answers.get(number, GoalEvent(number, GoalState.ACCEPTED))
        if answer is not None:
            self.events.append(answer)
        if answer is not None and answer.state is GoalState.ACCEPTED:
            if self.active is not None:
                self.events.append(GoalEvent(self.active, GoalState.PREEMPTED, "by a new goal"))
            self.active = number
        return number

    def cancel_all(self) -> None:
        self.cancellations += 1
        if not self.is_deaf:
            number, self.active = self.active, None
            self.events.append(GoalEvent(number or len(self.goals), GoalState.PREEMPTED, "cancelled"))


class Bench(NamedTuple):
    """A loop with a scripted controller, and the plant's end of its link."""

    controller: ScriptedController
    plant: ProcessLink
    loop: TrajectoryLoop

    def turn(self, times: int, each: Callable[[Message], None] = lambda message: None) -> list[Message]:
        """Let the loop turn; return what it sent, each message being given to `each` at once."""
        heard: list[Message] = []
        for _ in range(times):
            self.loop.turn()
            while (message := self.plant.receive()) is not None:
                heard.append(message)
                each(message)
        return heard


def bench(ends: tuple[ProcessLink, ProcessLink]) -> Bench:
    controller = ScriptedController()
    loop = TrajectoryLoop(controller, ends[1], LIMITS, controller.monotonic)
    made = Bench(controller, ends[0], loop)
    made.turn(3)
    return made

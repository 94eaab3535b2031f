"""Report of a run: its skill invocations and their totals, as data that is rendered elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from aeros.runtime.ports import StepStatus


class StepRole(Enum):
    """The reason for which a skill was invoked."""

    STEP = "step"  # the first try of a step of the plan
    RETRY = "retry"  # a further try of the same step
    RECOVERY = "recovery"  # `between_tries`, or `on_failure` after the last try


@dataclass(frozen=True, slots=True)
class StepRecord:
    """One skill invocation of a run.

    Attributes:
        role: first try of a step, further try, or recovery after a failed one.
        module: id of the module.
        skill: id of the skill in its module.
        inputs: values of its inputs by name, SI.
        status: kind of its end.
        outcome: id of the measured outcome; None if no declared outcome was measured.
        failed: True if the agent counts it as a failure.
        reason: text of the reason; empty if it did not fail.
        started, ended: plant time, s.
        allowed, attenuated, denied: numbers of the gate's decisions on its actions.
    """

    role: StepRole
    module: str
    skill: str
    inputs: Mapping[str, Any]
    status: StepStatus
    outcome: str | None
    failed: bool
    reason: str
    started: float
    ended: float
    allowed: int
    attenuated: int
    denied: int

    @property
    def duration(self) -> float:
        """Seconds of plant time."""
        return self.ended - self.started


@dataclass(frozen=True, slots=True)
class RunReport:
    """Report of one instruction, from routing to the goal or to the reason that it was not reached.

    Attributes:
        instruction: words of the user.
        module: module of the task.
        task: id of the task.
        goal: goal as written.
        reached: True if the goal is measured as true; an unknown goal is not reached.
        measured: the variables of the goal and those that the task reports, as last measured: JSON values,
            None if unknown.
        steps: skill invocations in the order of their ends.
        replans: plans made because an earlier one failed or finished without the goal.
        reason: why the goal was not reached; None iff it was, or the request was skipped.
        skipped: True if it was not begun, as its condition does not hold: no success and no failure.
    """

    instruction: str
    module: str
    task: str
    goal: str
    reached: bool
    measured: Mapping[str, Any]
    steps: tuple[StepRecord, ...]
    replans: int
    reason: str | None
    skipped: bool = False

    @property
    def has_failed(self) -> bool:
        """True if the goal was pursued, or was to be, and is not reached."""
        return self.reason is not None

    @property
    def outcome(self) -> str:
        """The result in words: reached, skipped, or the reason that it was not reached."""
        if self.skipped:
            return "skipped, as its condition does not hold"
        return "goal reached" if self.reached else str(self.reason)

    @property
    def retries(self) -> int:
        """Number of further attempts of steps that had failed."""
        return sum(step.role is StepRole.RETRY for step in self.steps)

    @property
    def recoveries(self) -> int:
        """Number of runs of the skills that failures lead to."""
        return sum(step.role is StepRole.RECOVERY for step in self.steps)

    @property
    def allowed(self) -> int:
        """Number of actions that the gate allowed as requested."""
        return sum(step.allowed for step in self.steps)

    @property
    def attenuated(self) -> int:
        """Number of actions that the gate reduced and then allowed."""
        return sum(step.attenuated for step in self.steps)

    @property
    def denied(self) -> int:
        """Number of actions that the gate denied."""
        return sum(step.denied for step in self.steps)

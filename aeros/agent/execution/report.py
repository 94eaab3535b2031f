"""What a run reports: every skill invocation, and what they add up to.  Data, rendered elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from aeros.runtime.ports import StepStatus


class StepRole(Enum):
    """Why a skill was invoked."""

    STEP = "step"  # the first try of a step of the plan
    RETRY = "retry"  # a further try of the same step
    RECOVERY = "recovery"  # `on_failure`, between two tries


@dataclass(frozen=True, slots=True)
class StepRecord:
    """One skill invocation; times in plant seconds; `outcome` None where no declared one was measured."""

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
    """One instruction, from routing to the goal or to the reason why it was not reached.

    reached: whether the goal is measured as true; unknown is not reached.
    measured: the goal's variables as last measured, JSON values, None where unknown.
    replans: plans made because an earlier one failed or was exhausted.
    reason: None iff reached.
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

    @property
    def retries(self) -> int:
        """Further tries of a step that had failed."""
        return sum(step.role is StepRole.RETRY for step in self.steps)

    @property
    def recoveries(self) -> int:
        """Runs of an `on_failure` skill."""
        return sum(step.role is StepRole.RECOVERY for step in self.steps)

    @property
    def allowed(self) -> int:
        """Actions the gate allowed as they were asked for."""
        return sum(step.allowed for step in self.steps)

    @property
    def attenuated(self) -> int:
        """Actions the gate reduced and then allowed."""
        return sum(step.attenuated for step in self.steps)

    @property
    def denied(self) -> int:
        """Actions the gate denied."""
        return sum(step.denied for step in self.steps)

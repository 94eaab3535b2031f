"""An attempt to run a skill: while it is pending, while it runs, and its result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.agent.execution.dispatcher import Dispatch
from aeros.agent.execution.report import StepRecord, StepRole
from aeros.agent.execution.waiting import Wait
from aeros.agent.memory.store import EpisodeStart
from aeros.runtime.ports import StepHandle, StepResult, StepStatus

RAN_STATUSES: Final = frozenset(
    {
        StepStatus.FINISHED,
        StepStatus.STOPPED,
        StepStatus.TIMED_OUT,
        StepStatus.RAISED,
        StepStatus.HOLD_LOST,
    }
)
"""Endings of a skill that did run; only after these is a step tried again."""


def counts_toward_record(result: StepResult) -> bool:
    """Check if a result is evidence of how good the skill is.

    An end that others caused is none. A denial because of measured values alone is none either: the skill
    waits and tries again, so one person who stands nearby would count sixty times. Any other denial counts,
    because the skill requests what it may not do, and will do so again.

    Args:
        result: result of a step.

    Returns:
        True if it is evidence.
    """
    return result.status in RAN_STATUSES or (result.status is StepStatus.DENIED and not result.is_transient)


@dataclass(frozen=True, slots=True)
class AttemptResult:
    """The result of an attempt to run a skill.

    Attributes:
        failed: True also if the skill did not start.
        reason: why it failed.
        is_retryable: it ran and failed as declared, which is what retries are for. After a denial, a refusal,
            an unmet precondition, an undeclared or unknown outcome, an assumption of the plan is wrong
            instead.
        record: record of the invocation; None if it was not submitted.
        outputs: outputs of the skill by name (SI).
        no_retry_reason: why another attempt at once is hopeless, by memory or as it failed so before; empty
            if it is not.
        ends_run: it ended in an undeclared outcome, and the site stops the run then; or its code raised, it
            failed as before or gave a verdict, and nothing else provides the same.
        is_composed: it was a run of a composition, whose steps have records of their own.
        is_repeated: it failed as it did before in the same state, which chance does not explain, and is not
            tried again.
        is_stop: it was cancelled with a part of the plan, or not started for that, and ended in a known state
            that no proof excludes.
        is_verdict: its outcome says, for the second time, why no other try can succeed.
        is_exhausted: it was denied in several ways, and knows no other.
        pause_s: time that is to pass before another plan, plant seconds.
        wait: what may allow it later, after a denial or where it could not start; None if nothing may.
    """

    failed: bool
    reason: str
    is_retryable: bool = False
    record: StepRecord | None = None
    outputs: Mapping[str, Any] = field(default_factory=dict)
    no_retry_reason: str = ""
    ends_run: bool = False
    is_composed: bool = False
    is_repeated: bool = False
    is_verdict: bool = False
    pause_s: float = 0.0
    wait: Wait | None = None
    is_stop: bool = False
    is_exhausted: bool = False

    @property
    def final_words(self) -> str:
        """Words for an attempt that ends the run."""
        if self.is_verdict:
            return "gives up"
        if self.is_repeated:
            return "failed again as before in the same state, and nothing else is known to try"
        raised = self.record is not None and self.record.status is StepStatus.RAISED
        return "failed, and its code is not run again" if raised else "ended with an undeclared outcome"

    @property
    def is_transient(self) -> bool:
        """True if it may be allowed later."""
        return self.wait is not None

    @property
    def is_denied(self) -> bool:
        """True if the gate denied an action of it."""
        return self.record is not None and self.record.status is StepStatus.DENIED

    @property
    def is_halted(self) -> bool:
        """True if the operator stopped everything, so that nothing more starts."""
        return self.record is not None and self.record.status is StepStatus.HALTED


@dataclass(frozen=True, slots=True)
class PendingAttempt:
    """A request that was made, with the state in which it was made.

    Attributes:
        role: reason for the invocation: first try, retry or recovery.
        dispatch: the request and the providers that were considered.
        episode_start: the part of its episode in memory that is known before the step starts.
        episode_id: number of the attempt's episode in memory.
    """

    role: StepRole
    dispatch: Dispatch
    episode_start: EpisodeStart
    episode_id: int


@dataclass(frozen=True, slots=True)
class RunningAttempt:
    """An attempt that is running.

    Attributes:
        handle: the runtime's handle of the step.
        pending: the request that it came from.
    """

    handle: StepHandle
    pending: PendingAttempt

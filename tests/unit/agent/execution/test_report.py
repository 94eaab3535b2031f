"""The totals of a run's report, counted by hand."""

from __future__ import annotations

from dataclasses import replace

from aeros.agent.execution.report import RunReport, StepRecord, StepRole
from aeros.runtime.ports import StepStatus

STEP = StepRecord(
    StepRole.STEP, "m", "wrap", {}, StepStatus.FINISHED, "wrapped", False, "", 10.0, 12.5, 3, 1, 0
)
RETRY = replace(STEP, role=StepRole.RETRY, allowed=5, attenuated=0, denied=1)
RECOVERY = replace(STEP, role=StepRole.RECOVERY, allowed=0, attenuated=0, denied=4)


def report(*steps: StepRecord) -> RunReport:
    return RunReport("make dumplings", "m", "make", "cooked", True, {"cooked": True}, steps, 0, None)


def test_a_step_lasts_from_its_start_to_its_end() -> None:
    assert STEP.duration == 2.5


def test_totals_are_sums_over_the_steps() -> None:
    run = report(STEP, RETRY, RECOVERY, RETRY, STEP)
    assert (run.retries, run.recoveries) == (2, 1)
    assert (run.allowed, run.attenuated, run.denied) == (16, 2, 6)


def test_a_run_without_steps_has_totals_of_zero() -> None:
    run = report()
    assert (run.retries, run.recoveries, run.allowed, run.attenuated, run.denied) == (0, 0, 0, 0, 0)

"""The result of an attempt says in words how it ended the run, and what it is evidence of."""

from __future__ import annotations

import pytest

from aeros.agent.execution.attempt import RAN_STATUSES, AttemptResult, counts_toward_record
from aeros.agent.execution.report import StepRecord, StepRole
from aeros.runtime.ports import StepResult, StepStatus


def attempt(status: StepStatus, *, is_repeated: bool = False) -> AttemptResult:
    record = StepRecord(StepRole.STEP, "m", "x", {}, status, None, True, "why", 1.0, 2.0, 0, 0, 0)
    return AttemptResult(True, "why", record=record, ends_run=True, is_repeated=is_repeated)


def test_the_words_for_the_end_say_what_kind_of_end_it_is() -> None:
    assert "its code is not run again" in attempt(StepStatus.RAISED).final_words
    assert attempt(StepStatus.FINISHED).final_words == "ended with an undeclared outcome"
    assert "again as before" in attempt(StepStatus.STOPPED, is_repeated=True).final_words


@pytest.mark.parametrize("status", StepStatus)
def test_only_what_ran_or_was_denied_for_good_is_evidence(status: StepStatus) -> None:
    is_evidence = status in RAN_STATUSES or status is StepStatus.DENIED
    assert counts_toward_record(StepResult(status, "")) is is_evidence
    assert not counts_toward_record(StepResult(StepStatus.DENIED, "", is_transient=True))


def test_a_denial_and_a_halt_are_known_by_the_record() -> None:
    assert attempt(StepStatus.DENIED).is_denied
    assert attempt(StepStatus.HALTED).is_halted
    nothing = AttemptResult(True, "not started")
    assert not nothing.is_denied
    assert not nothing.is_halted

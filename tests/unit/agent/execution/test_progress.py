"""Progress of a plan: attempts are counted when they begin, and a halted one stays unfinished."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.execution.progress import AttemptHistory, PlanProgress, UnfinishedAttempt
from aeros.agent.execution.report import StepRecord, StepRole
from aeros.runtime.ports import LogHead, StepStatus

AT = (0, 1)
ATTEMPT = UnfinishedAttempt("m", "wrap", {"force": 0.5}, {"wrapped": False}, LogHead(3, "abc"))
DONE, FAILED = AttemptResult(failed=False, reason=""), AttemptResult(failed=True, reason="askew")


def halted() -> AttemptResult:
    record = StepRecord(
        StepRole.STEP, "m", "wrap", {}, StepStatus.HALTED, None, True, "stopped", 0.0, 1.0, 0, 0, 0
    )
    return AttemptResult(failed=True, reason="stopped", record=record)


def watched() -> tuple[PlanProgress, list[int]]:
    """A progress, and a list that grows with each change that a checkpoint must hold."""
    changes: list[int] = []
    return PlanProgress(on_change=lambda: changes.append(1)), changes


def test_a_step_that_was_never_tried_is_not_done_and_has_no_result() -> None:
    progress = PlanProgress()
    assert (progress.attempt_count(AT), progress.last_result(AT), progress.is_done(AT)) == (0, None, False)
    assert progress.unfinished_attempts() == []


def test_an_attempt_counts_from_its_beginning() -> None:
    progress, changes = watched()
    progress.start_attempt(AT, ATTEMPT)
    assert progress.attempts == {AT: AttemptHistory(1, ATTEMPT, None)}
    assert (progress.attempt_count(AT), progress.is_done(AT), len(changes)) == (1, False, 1)
    assert progress.unfinished_attempts() == [(AT, ATTEMPT)]


@pytest.mark.parametrize(("result", "done"), [(DONE, True), (FAILED, False)])
def test_an_attempt_that_did_not_fail_is_done(result: AttemptResult, *, done: bool) -> None:
    progress, changes = watched()
    progress.start_attempt(AT, ATTEMPT)
    progress.finish_attempt(AT, result)
    assert progress.attempts == {AT: AttemptHistory(1, None, result)}
    assert (progress.is_done(AT), progress.last_result(AT), len(changes)) == (done, result, 2)
    assert progress.unfinished_attempts() == []


def test_a_halted_attempt_stays_unfinished_and_is_no_change() -> None:
    progress, changes = watched()
    progress.start_attempt(AT, ATTEMPT)
    progress.finish_attempt(AT, halted())
    assert progress.unfinished_attempts() == [(AT, ATTEMPT)]
    assert (progress.last_result(AT), progress.is_done(AT), len(changes)) == (None, False, 1)


def test_a_further_attempt_keeps_the_result_of_the_one_before_until_it_ends() -> None:
    progress, _ = watched()
    progress.start_attempt(AT, ATTEMPT)
    progress.finish_attempt(AT, FAILED)
    progress.start_attempt(AT, ATTEMPT)
    assert progress.attempts[AT] == AttemptHistory(2, ATTEMPT, FAILED)


def test_an_attempt_that_never_started_is_not_counted() -> None:
    progress, _ = watched()
    progress.start_attempt(AT, ATTEMPT)
    progress.finish_attempt(AT, FAILED)
    progress.start_attempt(AT, ATTEMPT)
    progress.drop_attempt(AT)
    assert (progress.attempt_count(AT), progress.unfinished_attempts()) == (1, [])
    assert progress.last_result(AT) == FAILED


def test_a_step_marked_done_is_done_though_its_last_attempt_failed() -> None:
    progress, _ = watched()
    progress.start_attempt(AT, ATTEMPT)
    progress.finish_attempt(AT, FAILED)
    progress.mark_done(AT)
    assert progress.is_done(AT)
    assert not progress.is_done((0,))


@pytest.mark.parametrize("then", [True, False])
def test_the_choice_of_an_if_is_kept_and_is_a_change(*, then: bool) -> None:
    progress, changes = watched()
    progress.set_branch(AT, then)
    assert (progress.branch_choices, len(changes)) == ({AT: then}, 1)


def test_unfinished_attempts_come_in_the_order_of_the_plan() -> None:
    progress = PlanProgress()
    for at in ((1,), (0, 2), (0, 10), (0,)):
        progress.start_attempt(at, ATTEMPT)
    progress.finish_attempt((0, 2), DONE)
    assert [at for at, _ in progress.unfinished_attempts()] == [(0,), (0, 10), (1,)]


@given(st.lists(st.sampled_from(["fail", "halt", "drop"]), max_size=8))
def test_the_count_is_of_the_attempts_that_were_not_dropped(ends: list[str]) -> None:
    progress = PlanProgress()
    how: dict[str, Callable[[], None]] = {
        "fail": lambda: progress.finish_attempt(AT, FAILED),
        "halt": lambda: progress.finish_attempt(AT, halted()),
        "drop": lambda: progress.drop_attempt(AT),
    }
    for end in ends:
        progress.start_attempt(AT, ATTEMPT)
        how[end]()
    assert progress.attempt_count(AT) == len([end for end in ends if end != "drop"])
    assert len(progress.unfinished_attempts()) == (ends[-1:] == ["halt"])

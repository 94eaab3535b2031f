"""A failed attempt leads to a retry, a wait, a pause, another provider, or the end of the run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.agent.execution.repeats import LOOK_AGAIN_PAUSE_S
from aeros.agent.execution.waiting import Wait
from aeros.agent.memory.posterior import SuccessRecord
from aeros.runtime.ports import StepResult, StepStatus
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause
from tests.unit.agent.dumplings import DUMPLING, module, outcome, skill
from tests.unit.agent.fake_runtime import Ending
from tests.unit.agent.kitchen import Kitchen


@pytest.mark.parametrize(
    ("status", "is_transient", "counts", "retries"),
    [
        (StepStatus.FINISHED, False, True, True),
        (StepStatus.STOPPED, False, True, True),
        (StepStatus.TIMED_OUT, False, True, True),
        (StepStatus.RAISED, False, True, False),
        (StepStatus.HOLD_LOST, False, True, True),
        (StepStatus.DENIED, False, True, False),
        (StepStatus.DENIED, True, False, False),
        (StepStatus.CANCELLED, False, False, False),
        (StepStatus.HALTED, False, False, False),
        (StepStatus.REFUSED, False, False, False),
    ],
)
def test_of_a_failure_the_status_decides_what_it_says_of_the_skill_and_if_it_is_tried_again(
    status: StepStatus, *, is_transient: bool, counts: bool, retries: bool
) -> None:
    ended = StepResult(status, "so it ended", is_transient=is_transient)
    kitchen = Kitchen({"boil": [ended]}, dumpling_wrapped=True)
    result = kitchen.attempt("boil")
    assert (result.failed, result.is_retryable, result.is_transient) == (True, retries, is_transient)
    assert result.is_denied is (status is StepStatus.DENIED)
    assert result.is_halted is (status is StepStatus.HALTED)
    ((_, end),) = kitchen.memory.ends
    assert end.counts_toward_record is counts
    is_avoided = status is StepStatus.RAISED or (status is StepStatus.DENIED and not is_transient)
    assert result.ends_run is (status is StepStatus.RAISED)
    assert kitchen.runner.dispatcher.denied == ({("dumpling", "boil")} if is_avoided else set())


@pytest.mark.parametrize(("denials", "is_exhausted"), [(1, False), (2, False), (3, True)])
def test_denials_count_that_no_other_way_made_up_for(denials: int, is_exhausted: bool) -> None:
    ended = StepResult(StepStatus.DENIED, "too near", denied=9, denials=denials)
    result = Kitchen({"boil": [ended]}, dumpling_wrapped=True).attempt("boil")
    assert result.is_exhausted is is_exhausted


def test_a_failure_is_hopeless_where_the_record_says_so() -> None:
    ending: dict[str, list[Ending]] = {"boil": ["nothing_changed"]}
    hopeless = Kitchen(ending, SuccessRecord(0, 28), dumpling_wrapped=True).attempt("boil")
    assert hopeless.no_retry_reason == "succeeded before in this context: `boil` 0 of 28"
    assert Kitchen(ending, SuccessRecord(0, 27), dumpling_wrapped=True).attempt("boil").no_retry_reason == ""
    success = Kitchen({}, SuccessRecord(0, 28), dumpling_wrapped=True).attempt("boil")
    assert success.no_retry_reason == ""


@pytest.mark.parametrize("status", [StepStatus.STOPPED, StepStatus.TIMED_OUT, StepStatus.REFUSED])
def test_the_third_failure_of_a_kind_ends_the_run_and_a_pause_comes_before(status: StepStatus) -> None:
    kitchen = Kitchen({"boil": [StepResult(status, "something is in the way")] * 3}, dumpling_wrapped=True)
    first, second, third = (kitchen.attempt("boil") for _ in range(3))
    assert [one.pause_s for one in (first, second, third)] == [0.0, LOOK_AGAIN_PAUSE_S, LOOK_AGAIN_PAUSE_S]
    assert [one.ends_run for one in (first, second, third)] == [False, False, True]
    assert [one.no_retry_reason for one in (first, second)] == ["", "it failed 2 times in the same way"]
    assert third.final_words == "failed again as before in the same state, and nothing else is known to try"


@pytest.mark.parametrize("can_wrap", [True, False])
def test_where_another_can_do_the_same_the_third_failure_is_the_last_of_one_only(*, can_wrap: bool) -> None:
    stop = StepResult(StepStatus.STOPPED, "something is in the way")
    there = dict.fromkeys(("dough_on_workspace", "filling_on_workspace", "wrapper_aligned"), can_wrap)
    kitchen = Kitchen({"fold": [stop] * 9, "wrap": [stop] * 9})
    kitchen.runtime.state |= there
    kitchen.runner.observe()
    fold = skill("fold", outcome("folded", {"dumpling_wrapped": True}), outcome("not", {}, failure=True))
    ecm = module("dumpling", (*DUMPLING.skills.values(), fold), *DUMPLING.tasks.values())
    kitchen.runtime.modules = {"dumpling": replace(ecm, capabilities={"closing": ("fold", "wrap")})}
    results = [kitchen.attempt("closing") for _ in range(6 if can_wrap else 3)]
    assert [one.ends_run for one in results] == [False] * (len(results) - 1) + [True]
    assert sum(one.is_repeated for one in results) == (2 if can_wrap else 1)


def test_a_quantity_is_waited_for_and_a_predicate_is_not() -> None:
    kitchen = Kitchen()
    part = UnmetBound("fill_level", 0.2, "at least", 0.5)
    low = Cause("precondition", "dumpling.boil", "fill_level >= 0.5", shortfalls=(part,))
    step: tuple[str, str, dict[str, Any]] = ("dumpling", "boil", {})
    waits = kitchen.runner.failure_rules.after_no_start(step, "too low", (low,), {"cooked": False})
    assert (waits.is_transient, waits.wait) == (True, Wait("fill_level is at least 0.5"))
    part = UnmetBound("dumpling_wrapped", False, "is", True)
    unwrapped = replace(low, shortfalls=(part,))
    for state, ends in (({"cooked": False}, False), (None, False), ({"cooked": False}, True)):
        result = kitchen.runner.failure_rules.after_no_start(step, "not yet", (unwrapped,), state)
        assert (result.is_transient, result.ends_run, result.is_repeated) == (False, ends, ends)

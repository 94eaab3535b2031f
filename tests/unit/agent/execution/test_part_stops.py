"""Parts of plans under held conditions and within times: they stop, and what is around them goes on."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import inf
from typing import Any

import pytest

from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.part_stops import (
    PlanFailure,
    StopScope,
    failure_of_attempt,
    result_of_composition,
    undecided_failure,
    worse_failure,
)
from aeros.agent.execution.plan_executor import PlanExecutor
from aeros.agent.execution.progress import PlanProgress
from aeros.agent.execution.report import StepRecord, StepRole
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.planning.task_graph import Part, PlanStep, TaskGraph, verify_plan
from aeros.runtime.ports import EndedStep, StepHandle, StepResult, StepStatus
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.step_graph import Fallback, HeldPart, Par, Seq, TimedPart
from tests.differential.real_loop import Forgetful
from tests.unit.agent.dumplings import SPAN, site, term
from tests.unit.agent.execution.test_plan_executor import MODULES, step
from tests.unit.agent.fake_runtime import FakeRuntime

CONDITION = ActionCondition(term("dumpling_wrapped"), "dumpling_wrapped", SPAN)
OTHER = ActionCondition(term("area == table"), "area == table", SPAN)


class Losing(FakeRuntime):
    """A runtime in which the held condition of a skill is lost while it runs, as often as is said."""

    def __init__(self, lost: dict[str, int] | None = None, **more: Any) -> None:
        super().__init__(MODULES, **more)
        self.lost = lost or {}
        self.state |= {"dumpling_wrapped": True, "area": "table"}
        self.changes: dict[str, dict[str, Any]] = {}

    def wait(self, until: float = inf) -> EndedStep | None:
        for handle, request in list(self.under_way.items()):
            if request.skill in self.lost and handle not in self.cancelled:
                del self.under_way[handle]
                self.state |= self.changes.get(request.skill, {})
                lost = self.lost[request.skill]
                return EndedStep(handle, StepResult(StepStatus.CANCELLED, "it slipped", lost_hold=lost))
        return super().wait(until)


class Bench:
    def __init__(self, runtime: FakeRuntime) -> None:
        self.runtime = runtime
        memory = Forgetful()
        self.journal = Journal(runtime, memory, None)
        self.attempts = StepRunner(runtime, memory, self.journal, "task")

    def run(
        self, *parts: Part, is_over: Callable[[], bool] = lambda: False, progress: PlanProgress | None = None
    ) -> PlanFailure | None:
        assert verify_plan(TaskGraph(parts), MODULES, site()) == []
        return PlanExecutor(self.attempts, self.journal, is_over).run(Seq(parts), progress)

    @property
    def started(self) -> list[str]:
        return [one.skill for one in self.attempts.records]

    @property
    def statuses(self) -> list[StepStatus]:
        return [one.status for one in self.attempts.records]


def held(part: Part, condition: ActionCondition = CONDITION) -> HeldPart[PlanStep]:
    return HeldPart(part, SPAN, False, condition)


def within(part: Part, seconds: float) -> TimedPart[PlanStep]:
    return TimedPart(part, SPAN, False, Fraction(seconds))


def either(*parts: Part) -> Fallback[PlanStep]:
    return Fallback(parts, SPAN)


def test_a_part_whose_condition_holds_does_what_it_does_alone() -> None:
    bench = Bench(Losing())
    assert bench.run(held(Seq((step("dough"), step("water")))), step("align")) is None
    assert bench.started == ["dough", "water", "align"]
    assert [one.held for one in bench.runtime.requests] == [(CONDITION,), (CONDITION,), ()]


@pytest.mark.parametrize("measured", [{"dumpling_wrapped": False}, {"dumpling_wrapped": None}])
def test_a_part_whose_condition_is_not_measured_as_true_does_not_begin(measured: dict[str, Any]) -> None:
    runtime = Losing()
    runtime.state = {**runtime.state, **measured}
    runtime.state = {name: value for name, value in runtime.state.items() if value is not None}
    bench = Bench(runtime)
    end = bench.run(either(held(step("dough")), step("water")))
    assert (end, bench.started) == (None, ["water"])


def test_a_condition_that_is_lost_while_a_step_runs_stops_the_part_and_an_alternative_follows() -> None:
    bench = Bench(Losing({"dough": 0}))
    assert bench.run(either(held(Seq((step("dough", 2), step("filling")))), step("water"))) is None
    assert bench.started == ["dough", "water"]
    assert bench.statuses == [StepStatus.CANCELLED, StepStatus.FINISHED]


def test_a_part_without_alternative_fails_with_the_reason() -> None:
    end = Bench(Losing({"dough": 0})).run(held(step("dough")))
    assert end == PlanFailure("`dumpling_wrapped` is not held: it slipped")
    assert end.is_declared


@pytest.mark.parametrize(("place", "started"), [(0, ["dough", "align"]), (1, ["dough", "water"])])
def test_the_part_stops_whose_condition_was_lost(place: int, started: list[str]) -> None:
    bench = Bench(Losing({"dough": place}))
    inner = either(held(step("dough"), OTHER), step("water"))
    assert bench.run(either(held(inner), step("align"))) is None
    assert bench.started == started


def test_a_condition_that_a_step_ends_stops_the_part_even_after_its_last_step() -> None:
    runtime = Losing(endings={"dough": [{"dough_on_workspace": True, "dumpling_wrapped": False}]})
    bench = Bench(runtime)
    assert bench.run(either(held(step("dough")), step("water"))) is None
    assert bench.started == ["dough", "water"]


def test_a_stop_hides_no_state_that_the_proof_excludes() -> None:
    runtime = Losing({"wrap": 0})
    runtime.state["wrapper_aligned"] = True
    runtime.changes["wrap"] = {"dumpling_wrapped": False}
    bench = Bench(runtime)
    # Neither the state before nor that of an outcome, and the condition does not read it.
    end = bench.run(either(held(step("wrap"), OTHER), step("water")))
    assert end is not None
    assert (end.is_declared, bench.started) == (False, ["wrap"])
    free = Losing({"wrap": 0})
    free.state["wrapper_aligned"] = True
    free.changes["wrap"] = {"dumpling_wrapped": False}
    assert Bench(free).run(either(held(step("wrap")), step("water"))) is None


def test_the_steps_of_a_par_are_cancelled_together() -> None:
    bench = Bench(Losing({"filling": 0}))
    par = Par((Seq((step("dough"), step("water"))), step("filling")), SPAN)
    assert bench.run(either(held(par), step("align"))) is None
    assert (bench.started, bench.statuses[:2]) == (
        ["filling", "dough", "align"],
        [StepStatus.CANCELLED] * 2,
    )


def test_nothing_fails_once_the_goal_is_reached() -> None:
    runtime = Losing(endings={"dough": [{"dough_on_workspace": True, "dumpling_wrapped": False}]})
    bench = Bench(runtime)
    assert bench.run(held(step("dough")), is_over=lambda: runtime.state["dough_on_workspace"]) is None


class Slow(FakeRuntime):
    """A runtime in which each step takes a time of its own, s."""

    def __init__(self, **seconds: float) -> None:
        super().__init__(MODULES)
        self.seconds = seconds
        self.begun: dict[StepHandle, float] = {}

    def wait(self, until: float = inf) -> EndedStep | None:
        for handle, request in list(self.under_way.items()):
            if handle in self.cancelled:
                return super().wait(until)
            ends = self.begun.setdefault(handle, self.clock) + self.seconds[request.skill]
            if ends > until:
                assert self.clock < until - self.early, "it would wait for ever"
                self.clock = until - self.early
                return None
            self.clock = ends - 1.0  # `submit` adds a second
            return EndedStep(handle, self.submit(self.under_way.pop(handle)))
        return super().wait(until)


@pytest.mark.parametrize("early", [0.0, 0.004])
@pytest.mark.parametrize(
    ("limit", "started"),
    [
        (7, ["dough", "water"]),
        (6.5, ["dough", "water", "align"]),
        (4, ["dough", "align"]),
        (3, ["dough", "align"]),
    ],
)
def test_a_part_is_stopped_when_its_time_has_passed(limit: float, started: list[str], early: float) -> None:
    bench = Bench(Slow(dough=4.0, water=3.0, align=1.0))
    bench.runtime.early = early
    assert bench.run(either(within(Seq((step("dough"), step("water"))), limit), step("align"))) is None
    assert bench.started == started


def test_a_part_is_stopped_in_time_where_waits_end_a_tick_early(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(Slow(dough=4.0, align=1.0))
    wait, early = bench.runtime.wait, []

    def wait_in_ticks(until: float = inf) -> EndedStep | None:
        ended = wait(until)
        if ended is None:
            early.append(until)
            assert len(early) < 10
            bench.runtime.clock -= 0.002
        return ended

    monkeypatch.setattr(bench.runtime, "wait", wait_in_ticks)
    assert bench.run(either(within(step("dough"), 2), step("align"))) is None
    assert bench.started == ["dough", "align"]


def test_the_innermost_time_that_passes_first_stops_its_part_alone() -> None:
    bench = Bench(Slow(dough=4.0, water=3.0, align=1.0))
    inner = either(within(step("dough"), 2), step("water"))
    assert bench.run(either(within(inner, 6), step("align"))) is None
    assert bench.started == ["dough", "water"]


def test_a_resumed_part_has_the_time_that_is_left() -> None:
    progress = PlanProgress()
    runtime = Slow(dough=4.0, water=3.0)
    progress.begin_part((0, 0), runtime.clock - 9.0)
    bench = Bench(runtime)
    assert bench.run(either(within(step("dough"), 10), step("water")), progress=progress) is None
    assert bench.started == ["dough", "water"]


def test_a_resumed_part_that_was_done_is_not_held_again() -> None:
    progress = PlanProgress()
    runtime = Losing()
    bench = Bench(runtime)
    parts = (held(step("dough")), step("water"))
    assert bench.run(*parts, progress=progress) is None
    runtime.state["dumpling_wrapped"] = False
    bench.attempts.observe()
    assert bench.run(*parts, progress=progress) is None
    assert bench.started == ["dough", "water"]


def test_of_parallel_failures_one_that_no_plan_provides_for_decides() -> None:
    stop = PlanFailure("stopped", is_stop=True)
    declared, other = PlanFailure("declared", is_declared=True), PlanFailure("other")
    assert worse_failure(None, stop) is stop
    assert worse_failure(stop, None) is stop
    assert worse_failure(stop, other) is other
    assert worse_failure(stop, declared) is stop
    assert worse_failure(declared, other) is declared
    final = PlanFailure("final", is_final=True)
    assert worse_failure(declared, final) is final
    assert worse_failure(final, declared) is final
    first = PlanFailure("first", is_final=True)
    assert worse_failure(first, final) is first


def test_a_scope_yields_the_steps_and_deadlines_inside_it() -> None:
    outer = StopScope(deadline=5.0)
    inner = StopScope(outer, deadline=3.0)
    outer.children.append(inner)
    outer.running |= {StepHandle(2)}
    inner.running |= {StepHandle(1)}
    assert [one.deadline for one in outer.running_deadlines()] == [5.0, 3.0]
    assert list(outer.cancel("over")) == [2, 1]
    assert (inner.cancel_reason, list(outer.running_deadlines())) == ("over", [])


STEP = PlanStep("kitchen", "dough")


@pytest.mark.parametrize("is_stop", [False, True])
@pytest.mark.parametrize("is_declared", [False, True])
def test_a_composition_fails_as_its_plan_does(is_declared: bool, is_stop: bool) -> None:
    failure = PlanFailure("why", is_declared=is_declared, is_stop=is_stop)
    attempt = result_of_composition(failure)
    assert (attempt.failed, attempt.is_retryable, attempt.is_stop) == (True, is_declared, is_stop)
    again = failure_of_attempt(STEP, attempt, set())
    assert (again.reason, again.is_declared, again.is_stop) == ("why", is_declared, is_stop)
    assert not result_of_composition(None).failed


def test_a_step_that_was_not_started_for_a_stop_says_so() -> None:
    attempt = AttemptResult(failed=True, reason="cancelled: late", is_stop=True)
    failure = failure_of_attempt(STEP, attempt, set())
    assert failure == PlanFailure("`kitchen.dough` failed: cancelled: late")
    assert failure.is_stop


def test_a_condition_without_a_branch_is_no_declared_failure() -> None:
    failure = undecided_failure("wrapped", "it is not measured", ())
    assert not failure.is_declared
    assert failure.reason.endswith("if `wrapped` is not met: it is not measured")


@pytest.mark.parametrize("is_exhausted", [False, True])
def test_a_step_that_was_denied_in_several_ways_is_not_tried_again(is_exhausted: bool) -> None:
    record = StepRecord(
        *(StepRole.STEP, "dumpling", "prepare", {}, StepStatus.DENIED, None),
        failed=True,
        reason="denied: too near",
        started=0.0,
        ended=1.0,
        allowed=0,
        attenuated=0,
        denied=4,
    )
    attempt = AttemptResult(failed=True, reason=record.reason, record=record, is_exhausted=is_exhausted)
    failure = failure_of_attempt(STEP, attempt, set())
    assert failure.is_final is is_exhausted
    assert failure.reason.endswith("too near")

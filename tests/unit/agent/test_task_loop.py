from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.agent import open_temporary_agent, start_agent
from aeros.agent.execution.repeats import LOOK_AGAIN_PAUSE_S, SECOND_LOOK_PAUSE_S
from aeros.agent.execution.report import RunReport, StepRole
from aeros.agent.execution.waiting import MAX_WAIT_S, Wait
from aeros.agent.planning.base import Planner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.recovery.checkpoint import CheckpointStore, TaskCheckpoint
from aeros.agent.task_loop import LONG_WAIT_TRIES, RETRY_INTERVAL_S
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import Runtime, StepRequest, StepResult, StepStatus
from aeros.spec.model.cause import Cause
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Definition
from aeros.spec.model.policy import Quota
from tests.unit.agent.dumplings import (
    DUMPLING,
    MAKE_DUMPLINGS,
    SPAN,
    module,
    outcome,
    rule,
    site,
    skill,
    task,
    term,
)
from tests.unit.agent.fake_runtime import Ending, FakeRuntime


def run(runtime: Runtime, planner: Planner | None = None) -> RunReport:
    with open_temporary_agent("chef", runtime, planner) as agent:
        return agent.run("Make dumplings!")


class Fixed:
    """A planner that proposes the same thing every time."""

    name = "fixed"

    def __init__(self, proposal: Any) -> None:
        self.proposal = proposal
        self.asked = 0

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        self.asked += 1
        if isinstance(self.proposal, Exception):
            raise self.proposal
        plan: TaskGraph = self.proposal
        return plan


def counts(report: RunReport) -> tuple[int, int, int, int]:
    return len(report.steps), report.retries, report.recoveries, report.replans


def test_without_failures_every_rule_gives_one_step() -> None:
    runtime = FakeRuntime()
    report = run(runtime)
    assert report.reached
    assert report.reason is None
    assert runtime.submitted == ["prepare", "recover", "wrap", "boil"]
    assert counts(report) == (4, 0, 0, 0)
    assert (report.allowed, report.attenuated, report.denied) == (8, 4, 0)
    assert report.measured == {"dumpling_cooked": True}
    assert [step.duration for step in report.steps] == [1.0] * 4


def test_a_goal_that_holds_already_needs_no_step() -> None:
    runtime = FakeRuntime()
    runtime.state["dumpling_cooked"] = True
    assert counts(run(runtime)) == (0, 0, 0, 0)


def test_the_goal_ends_the_run_amid_a_plan() -> None:
    runtime = FakeRuntime(endings={"wrap": [{"dumpling_wrapped": True, "dumpling_cooked": True}]})
    assert run(runtime).reached
    assert runtime.submitted == ["prepare", "recover", "wrap"]


def test_a_failed_step_is_recovered_and_tried_again() -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"]})
    report = run(runtime)
    assert runtime.submitted == ["prepare", "recover", "wrap", "recover", "wrap", "boil"]
    assert counts(report) == (6, 1, 1, 0)
    roles = [step.role for step in report.steps]
    assert roles == [
        StepRole.STEP,
        StepRole.STEP,
        StepRole.STEP,
        StepRole.RECOVERY,
        StepRole.RETRY,
        StepRole.STEP,
    ]


def test_retries_exhausted_mean_one_counted_replan() -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"] * 3})
    report = run(runtime)
    assert report.reached
    wrapping = ["wrap", "recover", "wrap", "recover", "wrap"]
    assert runtime.submitted == ["prepare", "recover", *wrapping, "recover", "wrap", "boil"]
    assert counts(report) == (10, 2, 2, 1)


def test_the_cap_on_replans_ends_the_run() -> None:
    runtime = FakeRuntime(endings={"boil": ["nothing_changed"] * 99}, at=site(replans=10))
    report = run(runtime)
    assert not report.reached
    assert report.replans == 10
    assert runtime.submitted.count("boil") == 11
    assert report.reason is not None
    assert "after 10 re-plans" in report.reason
    assert "outcome `nothing_changed`" in report.reason
    assert report.measured == {"dumpling_cooked": False}


def test_an_exhausted_plan_without_the_goal_is_replanned() -> None:
    runtime = FakeRuntime(endings={"boil": [{"dumpling_cooked": True}]})
    never = task(
        "make_dumplings", ("make dumplings",), "dumpling_cooked and area == pot", rule("area == pot", "boil")
    )
    runtime.modules = {"dumpling": module("dumpling", tuple(DUMPLING.skills.values()), never)}
    runtime.state |= {"dumpling_wrapped": True}
    runtime.endings["boil"] = [{"dumpling_cooked": True}, {"area": "pot"}]
    report = run(runtime)
    assert report.reached
    assert counts(report) == (2, 0, 0, 1)


def test_a_goal_that_came_true_while_planning_needs_no_step() -> None:
    runtime = FakeRuntime()

    class Slow(Fixed):
        def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
            runtime.state["dumpling_cooked"] = True
            return super().plan(routed, world, modules)

    report = run(runtime, Slow(TaskGraph((PlanStep("dumpling", "prepare"),))))
    assert report.reached
    assert runtime.submitted == []


def test_a_step_that_became_needless_is_left_out() -> None:
    prepared = {"dough_on_workspace": True, "filling_on_workspace": True, "wrapper_aligned": True}
    runtime = FakeRuntime(endings={"prepare": [prepared]})
    report = run(runtime)
    assert runtime.submitted == ["prepare", "wrap", "boil"]
    assert report.replans == 0
    assert "step-skipped" in runtime.kinds()


def test_an_unmet_precondition_is_not_submitted_and_replans() -> None:
    runtime = FakeRuntime(endings={"prepare": [{"dough_on_workspace": True}] * 99})
    report = run(runtime)
    assert not report.reached
    assert runtime.submitted == ["prepare"] * 4, "once from the start, and three times from the same state"
    assert "failed again as before in the same state" in str(report.reason)


def test_a_plan_that_leaves_the_same_state_three_times_is_given_up() -> None:
    runtime = FakeRuntime()

    report = run(runtime, Fixed(TaskGraph((PlanStep("dumpling", "prepare"),))))
    assert not report.reached
    assert runtime.submitted == ["prepare"] * 3
    assert report.reason is not None
    assert "the same plan left the same state each time; `dumpling_cooked` = False" in report.reason


def test_a_stale_precondition_is_unmet() -> None:
    boil = task("make_dumplings", ("make dumplings",), "dumpling_cooked", rule("dumpling_cooked", "boil"))
    runtime = FakeRuntime({"dumpling": module("dumpling", tuple(DUMPLING.skills.values()), boil)})
    runtime.state["dumpling_wrapped"] = True
    runtime.ages["dumpling_wrapped"] = 5.5
    report = run(runtime)
    assert runtime.submitted == []
    assert report.replans == 0
    assert report.reason is not None
    assert "`dumpling_wrapped` was measured 5.5 s ago; 5 s is allowed" in report.reason
    assert report.reason.startswith("60 s of waiting until `dumpling_wrapped` is measured did not help: ")
    runtime.ages.clear()
    assert run(runtime).reached


def test_an_unknown_goal_is_not_reached() -> None:
    runtime = FakeRuntime()
    runtime.ages["dumpling_cooked"] = 6.0
    report = run(runtime)
    assert runtime.state["dumpling_cooked"]
    assert not report.reached
    assert report.measured == {"dumpling_cooked": None}


def test_an_undeclared_outcome_is_noted_not_retried_and_replanned() -> None:
    # Neither wrapped nor misaligned: wrapper_aligned stays true, dumpling_wrapped stays false.
    runtime = FakeRuntime(endings={"wrap": [{}]})
    report = run(runtime)
    assert report.reached
    assert runtime.submitted == ["prepare", "recover", "wrap", "wrap", "boil"]
    assert counts(report) == (5, 0, 0, 1)
    assert report.steps[2].outcome is None
    assert report.steps[2].failed
    (details,) = [details for kind, details in runtime.notes if kind == "broken-assumption"]
    assert details["skill"] == "dumpling.wrap"
    assert details["after"]["dumpling_wrapped"] is False
    assert (details["halted"], details["stops"]) == (False, False)


def test_an_undeclared_outcome_ends_the_run_where_the_site_does_not_say_otherwise() -> None:
    runtime = FakeRuntime(endings={"wrap": [{}]}, at=site(stops_at_undeclared=True))
    report = run(runtime)
    assert not report.reached
    assert runtime.submitted == ["prepare", "recover", "wrap"]
    assert report.replans == 0
    assert report.reason is not None
    assert report.reason.startswith("`dumpling.wrap` ended with an undeclared outcome")


def test_a_broken_hold_condition_is_a_failed_try_that_is_repeated() -> None:
    holding = skill("boil", outcome("cooked", {"dumpling_cooked": True}), hold="dumpling_wrapped")
    boil = task(
        "make_dumplings", ("make dumplings",), "dumpling_cooked", rule("dumpling_cooked", "boil", retry=2)
    )
    runtime = FakeRuntime(
        {"dumpling": module("dumpling", (holding,), boil)}, endings={"boil": [StepStatus.HOLD_LOST]}
    )
    runtime.state["dumpling_wrapped"] = True
    report = run(runtime)
    assert report.reached
    assert counts(report) == (2, 1, 0, 0)
    assert "broken-assumption" not in runtime.kinds()


def test_a_request_denied_twice_ends_the_run() -> None:
    runtime = FakeRuntime(endings={"boil": [StepStatus.DENIED] * 9})
    report = run(runtime)
    assert runtime.submitted.count("boil") == 2
    assert report.replans == 1
    assert report.denied == 2
    assert report.reason is not None
    assert "denied a second time" in report.reason


PERSON_NEARBY = StepResult(StepStatus.DENIED, "somebody is near", denied=1, is_transient=True)


def test_a_denial_that_may_pass_is_waited_for_and_is_no_replan() -> None:
    runtime = FakeRuntime(endings={"boil": [PERSON_NEARBY] * 20})
    report = run(runtime)
    assert report.reached
    assert report.replans == 0
    assert runtime.submitted.count("boil") == 21
    assert runtime.kinds().count("wait-started") == 20
    assert runtime.clock == 100.0 + len(runtime.submitted) + 20 * RETRY_INTERVAL_S


def test_patience_comes_to_an_end_and_is_new_after_a_plan_that_ended_otherwise() -> None:
    most = int(MAX_WAIT_S / RETRY_INTERVAL_S)
    runtime = FakeRuntime(
        endings={"boil": [*[PERSON_NEARBY] * most, StepStatus.STOPPED, *[PERSON_NEARBY] * 99]}
    )
    report = run(runtime)
    assert report.replans == 1
    assert runtime.submitted.count("boil") == most + 1 + most + 1
    assert report.reason is not None
    waited = "60 s of waiting until the measured state changes did not help"
    assert report.reason == f"{waited}: `dumpling.boil` was denied: somebody is near"


def test_after_two_stops_in_the_same_state_there_is_a_pause_and_then_a_last_try() -> None:
    stopped = StepResult(StepStatus.STOPPED, "contact with something", allowed=1)
    runtime = FakeRuntime(endings={"boil": [stopped] * 9})
    report = run(runtime)
    assert runtime.submitted.count("boil") == 3
    assert report.replans == 2
    assert runtime.clock == 100.0 + len(runtime.submitted) + LOOK_AGAIN_PAUSE_S
    words = "failed again as before in the same state, and nothing else is known to try"
    assert report.reason is not None
    assert report.reason.startswith(f"`dumpling.boil` {words}: stopped: contact with something")


def test_a_step_that_is_stopped_in_another_state_is_tried_again() -> None:
    class Changing(FakeRuntime):
        def submit(self, request: StepRequest) -> StepResult:
            self.state["dough_on_workspace"] = not self.state["dough_on_workspace"]
            return super().submit(request)

    runtime = Changing(endings={"boil": [StepStatus.STOPPED] * 3})
    assert run(runtime).reached
    assert runtime.submitted.count("boil") == 4


def test_a_step_that_cannot_start_where_it_is_planned_is_proposed_twice_at_most() -> None:
    runtime = FakeRuntime()
    report = run(runtime, Fixed(TaskGraph((PlanStep("dumpling", "boil"),))))
    assert runtime.kinds().count("step-not-started") == 2
    assert report.replans == 1
    assert "failed again as before in the same state" in str(report.reason)


def test_a_condition_on_a_quantity_is_waited_for() -> None:
    boil = skill("boil", outcome("cooked", {"dumpling_cooked": True}), precondition="fill_level >= 0.5")
    by_rule = task("make_dumplings", ("make dumplings",), "dumpling_cooked", rule("dumpling_cooked", "boil"))

    class Filling(FakeRuntime):
        def observe(self) -> Any:
            self.state["fill_level"] = 0.6 if self.clock >= 107.0 else 0.2
            return super().observe()

    runtime = Filling({"dumpling": module("dumpling", (boil,), by_rule)})
    report = run(runtime)
    assert report.reached
    assert report.replans == 0
    assert runtime.kinds().count("wait-started") == 7


def test_a_used_up_quota_is_waited_for_as_long_as_its_window_at_longer_intervals() -> None:
    quota = Quota("grips", frozenset({"grip"}), 3, Fraction(600), SPAN)
    cause = Cause("gate", "grips", "the quota `grips` of 3 is used up", code="AE742")
    denied = StepResult(StepStatus.DENIED, "AE742 grips", denied=1, is_transient=True, causes=(cause,))

    class Rationed(FakeRuntime):
        def submit(self, request: StepRequest) -> StepResult:
            return denied if request.skill == "boil" and self.clock < 690.0 else super().submit(request)

    runtime = Rationed(at=replace(site(), quotas=(quota,)))
    report = run(runtime)
    assert report.reached
    assert report.replans == 0
    waits = [details["seconds"] for kind, details in runtime.notes if kind == "wait-started"]
    assert set(waits) == {601.0 / LONG_WAIT_TRIES}
    assert len(waits) <= LONG_WAIT_TRIES


class SilentSensor(FakeRuntime):
    """Every motion is stopped at once until 4 s have gone by."""

    def submit(self, request: StepRequest) -> StepResult:
        if self.clock >= 104.0:
            return super().submit(request)
        cause = Cause("reading", "tool_position", "every value that a rule reads is measured")
        return StepResult(StepStatus.STOPPED, "monitor:input:tool_position", allowed=1, causes=(cause,))


def test_replans_are_not_used_up_while_a_sensor_is_silent() -> None:
    report = run(SilentSensor())
    assert report.reached
    assert report.replans == 4


def test_waiting_ends_with_the_time_for_the_task(tmp_path: Path) -> None:
    runtime = FakeRuntime(endings={"prepare": [PERSON_NEARBY] * 99})
    with start_agent(tmp_path, "chef", runtime) as agent:
        report = agent.run("Make dumplings!", timeout=7.5)
    assert runtime.clock == 107.5
    assert report.reason is not None
    assert "the time limit of 7.5 s has passed" in report.reason


def test_a_denial_is_not_retried_but_replanned() -> None:
    runtime = FakeRuntime(endings={"wrap": [StepStatus.DENIED]})
    # The halted wrap leaves a declared state behind, so that only the denial counts.
    runtime.state["wrapper_aligned"] = True
    report = run(runtime)
    assert report.reached
    assert counts(report) == (4, 0, 0, 1)


def test_a_halted_step_has_failed_but_what_is_measured_counts() -> None:
    class LateHalt(FakeRuntime):
        def submit(self, request: Any) -> Any:
            result = super().submit(request)
            halted = request.skill == "wrap"
            return replace(result, status=StepStatus.TIMED_OUT, reason="60 s") if halted else result

    runtime = LateHalt()
    report = run(runtime)
    assert report.reached
    assert runtime.submitted == ["prepare", "recover", "wrap", "boil"]
    assert counts(report) == (4, 0, 0, 0)
    assert report.steps[2].failed


def test_a_refused_step_is_not_retried() -> None:
    runtime = FakeRuntime(endings={"wrap": [StepStatus.REFUSED]})
    report = run(runtime)
    assert counts(report) == (5, 0, 0, 1)
    assert "broken-assumption" not in runtime.kinds()


@pytest.mark.parametrize("status", [StepStatus.STOPPED, StepStatus.TIMED_OUT])
def test_a_halted_step_is_replanned(status: StepStatus) -> None:
    runtime = FakeRuntime(endings={"boil": [status]})
    report = run(runtime)
    assert report.reached
    assert counts(report) == (5, 0, 0, 1)


def test_code_that_raised_is_not_run_again() -> None:
    runtime = FakeRuntime(endings={"boil": [StepStatus.RAISED]})
    report = run(runtime)
    assert (report.reached, report.replans, runtime.submitted.count("boil")) == (False, 0, 1)
    assert report.reason is not None
    assert report.reason.startswith("`dumpling.boil` failed, and its code is not run again: raised")


@pytest.mark.parametrize("skill", ["prepare", "recover", "wrap"])
def test_nothing_is_planned_again_once_the_operator_has_stopped_everything(skill: str) -> None:
    runtime = FakeRuntime(endings={skill: [StepStatus.HALTED]})
    report = run(runtime)
    assert not report.reached
    assert runtime.submitted[-1] == skill
    assert report.replans == 0
    assert report.reason is not None
    assert report.reason.startswith(f"`dumpling.{skill}` was stopped: halted")


def test_a_recovery_that_fails_as_declared_leaves_the_next_try_to_its_precondition() -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"]})
    failing = skill(
        "recover", outcome("aligned", {"wrapper_aligned": True}), outcome("not", {}, failure=True)
    )
    others = [one for one in DUMPLING.skills.values() if one.id != "recover"]
    runtime.modules = {"dumpling": module("dumpling", (failing, *others), MAKE_DUMPLINGS)}
    runtime.endings["recover"] = ["aligned", "not"]
    report = run(runtime)
    assert report.reached
    # The second wrap does not start, for the wrapper is not aligned; the new plan recovers first.
    assert runtime.submitted == ["prepare", "recover", "wrap", "recover", "recover", "wrap", "boil"]
    assert counts(report) == (7, 0, 1, 1)


def test_a_recovery_that_is_denied_ends_its_step() -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"], "recover": ["aligned", *[StepStatus.DENIED] * 9]})
    report = run(runtime)
    assert runtime.submitted == ["prepare", "recover", "wrap", "recover", "recover"]
    assert counts(report) == (5, 0, 1, 1)
    assert report.reason is not None
    assert "`dumpling.recover` was denied a second time" in report.reason


def test_a_module_deactivated_amid_the_run_ends_it_with_the_reason() -> None:
    class Swapping(FakeRuntime):
        def submit(self, request: Any) -> Any:
            result = super().submit(request)
            if request.skill == "prepare":
                self.modules = {}
            return result

    runtime = Swapping()
    report = run(runtime)
    assert runtime.submitted == ["prepare"]
    assert report.reason is not None
    assert "no active module is named `dumpling`" in report.reason


@pytest.mark.parametrize(
    ("proposal", "reason"),
    [
        (TaskGraph(()), "the plan is empty"),
        ("prepare, then wrap", "returned a str"),
        (ValueError("no idea"), "the planner failed: ValueError: no idea"),
        (TaskGraph((PlanStep("dumpling", "explode"),)), "has no skill `explode`"),
    ],
)
def test_a_rejected_plan_runs_no_step_and_its_repetition_ends_the_run(proposal: object, reason: str) -> None:
    runtime, planner = FakeRuntime(), Fixed(proposal)
    report = run(runtime, planner)
    assert runtime.submitted == []
    assert planner.asked == 2
    assert runtime.kinds().count("plan-rejected") == 2
    assert report.replans == 1
    assert report.reason is not None
    assert reason in report.reason


@given(
    seed=st.integers(0, 2**32),
    success=st.floats(0, 1),
    retries=st.integers(0, 3),
    replans=st.integers(0, 10),
)
def test_every_run_ends_within_its_bound(seed: int, success: float, retries: int, replans: int) -> None:
    source = random.Random(seed)  # noqa: S311  a seeded world, no secret

    def chance(skill: str, outcomes: list[str]) -> str:
        return outcomes[0] if source.random() < success else outcomes[-1]

    rules = tuple(replace(one, retry=retries) for one in MAKE_DUMPLINGS.rules)
    dumpling = module("dumpling", tuple(DUMPLING.skills.values()), replace(MAKE_DUMPLINGS, rules=rules))
    runtime = FakeRuntime({"dumpling": dumpling}, chance=chance, at=site(replans=replans))
    report = run(runtime)
    bound = (replans + 1) * sum(1 + 2 * one.retry for one in rules)
    assert len(report.steps) == len(runtime.submitted) <= bound
    assert report.replans <= replans
    assert report.reached == runtime.state["dumpling_cooked"] == (report.reason is None)


@pytest.mark.parametrize("timeout", [None, 6.0])
def test_a_resumed_run_keeps_its_deadline_and_ends_with_it(tmp_path: Path, timeout: float | None) -> None:
    runtime = FakeRuntime(endings={"wrap": [KeyboardInterrupt(), *["misaligned"] * 9]})
    with pytest.raises(KeyboardInterrupt), start_agent(tmp_path, "chef", runtime) as agent:
        agent.run("make dumplings", timeout=6.0)
    assert runtime.clock == 103.0
    with start_agent(tmp_path, "chef", runtime) as agent:
        report = agent.resume("make dumplings", timeout)
    assert runtime.clock == 106.0
    over = "the time limit has passed" if timeout is None else "the time limit of 6 s has passed"
    assert str(report.reason).startswith(f"{over}; the plan ended: ")


def test_a_resumed_run_has_the_re_plans_and_the_waiting_that_are_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("aeros.agent.execution.after_failure.wait_after_denial", lambda *_: Wait("it", 5.0))
    nearby = StepResult(StepStatus.DENIED, "somebody is near", denied=1, is_transient=True)
    script: list[Ending] = ["nothing_changed", *[nearby] * 3, KeyboardInterrupt(), *[nearby] * 9]
    runtime = FakeRuntime(endings={"boil": script}, at=site(replans=1))
    with pytest.raises(KeyboardInterrupt), start_agent(tmp_path, "chef", runtime) as agent:
        agent.run("dumplings")
    with start_agent(tmp_path, "chef", runtime) as agent:
        report = agent.resume("dumplings")
    assert report.replans == 1
    waited = "5 s of waiting until it did not help"
    assert report.reason == f"{waited}: `dumpling.boil` was denied: somebody is near"
    waits = [details["seconds"] for kind, details in runtime.notes if kind == "wait-started"]
    assert waits == [RETRY_INTERVAL_S] * 5


def test_the_agent_waits_after_a_plan_that_failed_at_once_and_not_after_another() -> None:
    quick = FakeRuntime(at=site(replans=1))
    run(quick, Fixed(TaskGraph((PlanStep("dumpling", "wrap"),))))
    assert (quick.clock, quick.submitted) == (101.0, [])
    slow = FakeRuntime(at=site(replans=1))
    run(slow, Fixed(TaskGraph((PlanStep("dumpling", "prepare"),))))
    assert (slow.clock, slow.submitted) == (102.0, ["prepare", "prepare"])


def test_the_number_of_re_plans_is_kept_before_it_is_reported(tmp_path: Path) -> None:
    class Dying(FakeRuntime):
        def note(self, event: str, details: Mapping[str, Any]) -> None:
            super().note(event, details)
            if event == "replan":
                raise KeyboardInterrupt

    runtime = Dying(endings={"boil": ["nothing_changed"]})
    with pytest.raises(KeyboardInterrupt), start_agent(tmp_path, "chef", runtime) as agent:
        agent.run("dumplings")
    newest = next(CheckpointStore(tmp_path).read())
    assert isinstance(newest, TaskCheckpoint)
    assert (newest.replans, newest.plan, newest.instruction) == (1, None, "dumplings")


VERDICT = "not here: five pictures show none"


def lost_dumpling() -> Ecm:
    """The module, with a verdict in place of `boil`'s outcome without effects."""
    boil = DUMPLING.skills["boil"]
    outcomes = {
        name: replace(one, verdict=VERDICT if one.failure and not one.effects else "")
        for name, one in boil.outcomes.items()
    }
    return replace(DUMPLING, skills={**DUMPLING.skills, "boil": replace(boil, outcomes=outcomes)})


def pursue(runtime: FakeRuntime, answers: list[bool] | None) -> tuple[RunReport, list[str]]:
    asked: list[str] = []

    def ask(reason: str) -> bool:
        asked.append(reason)
        assert answers is not None
        return answers.pop(0)

    runtime.modules = {"dumpling": lost_dumpling()}
    with open_temporary_agent("chef", runtime) as agent:
        agent.ask_for_help = None if answers is None else ask
        return agent.run("Make dumplings!"), asked


@pytest.mark.parametrize("answers", [None, [False]])
def test_the_second_verdict_of_a_kind_ends_the_run_with_its_words(answers: list[bool] | None) -> None:
    runtime = FakeRuntime(endings={"boil": ["nothing_changed"] * 9})
    is_asked = answers is not None
    report, asked = pursue(runtime, answers)
    assert report.reason == f"`dumpling.boil` gives up: {VERDICT}"
    assert runtime.submitted.count("boil") == 2
    assert runtime.clock == 100.0 + len(runtime.submitted) + SECOND_LOOK_PAUSE_S
    assert asked == ([report.reason] if is_asked else [])


def test_after_help_the_run_goes_on() -> None:
    runtime = FakeRuntime(endings={"boil": ["nothing_changed"] * 4})
    report, asked = pursue(runtime, [True, True])
    assert report.reached
    assert len(asked) == 2
    kinds = runtime.kinds()
    assert (kinds.count("help-asked"), kinds.count("help-given")) == (2, 2)


def test_the_values_behind_a_goal_by_definition_are_recorded_when_it_is_not_reached() -> None:
    definition = Definition(term("fill_level > 0.5"), "fill_level > 0.5", SPAN)
    kitchen = replace(DUMPLING, definitions={"dumpling_cooked": definition})
    endings: dict[str, list[Ending]] = {"boil": ["nothing_changed"] * 99}
    runtime = FakeRuntime(endings=endings, at=site(replans=0), modules={"dumpling": kitchen})
    assert not run(runtime).reached
    (noted,) = [details for event, details in runtime.notes if event == "goal-unmet"]
    assert noted["causes"][0]["rule"] == "dumpling_cooked"
    assert noted["causes"][0]["shortfalls"][0]["why"] == "is not measured"

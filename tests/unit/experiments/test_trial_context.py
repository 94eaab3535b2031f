"""The context of a trial: skills run as the agent runs them, and every call counts."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.execution.supervisor import StepAssessment
from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments import trial_context
from aeros.experiments.architecture import Budget, BudgetSpentError, CallLimitError
from aeros.experiments.trial_context import is_goal_measured
from aeros.runtime.ports import EndedStep, StepHandle, StepRequest, StepResult, StepStatus
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.agent.dumplings import DUMPLING, module, outcome, skill
from tests.unit.agent.fake_runtime import FakeRuntime
from tests.unit.experiments.support.dumpling_trials import Trial


def step(name: str) -> PlanStep:
    return PlanStep("dumpling", name)


# Counting.


def run(trial: Trial, *names: str) -> None:
    for name in names:
        trial.context.run(step(name))


def test_steps_actions_and_tries_are_counted() -> None:
    trial = Trial({"wrap": ["misaligned"]})
    run(trial, "prepare", "recover", "wrap", "recover", "wrap")
    counting = trial.counting
    assert (counting.steps, counting.actions, counting.denied) == (5, 15, 0)
    assert (counting.tries, counting.failed_tries, counting.first_failed) == (2, 1, True)


def test_only_the_first_try_decides_whether_the_first_failed() -> None:
    trial = Trial({"wrap": ["wrapped", "misaligned"]})
    run(trial, "prepare", "recover", "wrap", "wrap")
    assert (trial.counting.tries, trial.counting.failed_tries, trial.counting.first_failed) == (2, 1, False)


def test_without_judging_no_try_is_called_failed() -> None:
    trial = Trial({"wrap": ["misaligned"]}, judge=False)
    run(trial, "prepare", "recover", "wrap")
    assert (trial.counting.tries, trial.counting.failed_tries) == (1, 0)


def test_denied_actions_count_and_a_step_that_never_began_does_not() -> None:
    trial = Trial({"prepare": [StepStatus.DENIED]})
    run(trial, "prepare", "wrap")  # wrapping needs dough
    assert (trial.counting.steps, trial.counting.actions, trial.counting.denied) == (1, 1, 1)


class Refusing(FakeRuntime):
    """Refuses every step at once."""

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        return StepResult(StepStatus.REFUSED, "not now", denied=1)


def test_a_step_that_is_refused_at_once_is_none() -> None:
    trial = Trial(runtime=Refusing())
    assessment = trial.context.run(step("prepare"))
    assert assessment.failed
    assert "not now" in assessment.reason
    assert (trial.counting.steps, trial.counting.tries, trial.counting.denied) == (0, 0, 0)


def test_everything_else_is_the_runtimes() -> None:
    trial = Trial()
    assert trial.counting.now() == 100.0
    assert trial.counting.site is trial.runtime.site


def test_attributes_outside_the_port_are_not_passed_on() -> None:
    """The harness's runtime has the state of the plant, and so the truth, which no architecture gets."""
    trial = Trial()
    trial.runtime.truth = {"dumpling_cooked": True}  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="`truth` is not part of the runtime's port"):
        _ = trial.counting.truth


# The context.


def test_task_seed_and_runtime_are_those_of_the_trial() -> None:
    trial = Trial()
    assert (str(trial.context.task), trial.context.seed) == ("dumpling.make_dumplings", 7)
    assert trial.context.runtime is trial.counting


def test_the_plan_is_that_of_the_rules_from_what_is_measured() -> None:
    trial = Trial()
    assert [one.skill for one in trial.context.plan()] == ["prepare", "recover", "wrap", "boil"]
    trial.runtime.state["dumpling_wrapped"] = True
    trial.runtime.state["wrapper_aligned"] = True
    assert [one.skill for one in trial.context.plan()] == ["prepare", "boil"]


def test_the_goal_is_measured_and_unknown_is_not_reached() -> None:
    trial = Trial()
    assert not trial.context.is_goal_reached()
    trial.runtime.state["dumpling_cooked"] = True
    assert trial.context.is_goal_reached()
    del trial.runtime.state["dumpling_cooked"]
    assert not trial.context.is_goal_reached()


def test_a_skill_runs_with_its_defaults_and_is_assessed() -> None:
    trial = Trial()
    trial.runtime.state["dumpling_wrapped"] = True
    assessment = trial.context.run(step("boil"))
    assert (assessment.outcome, assessment.failed) == ("cooked", False)
    assert trial.runtime.requests == [StepRequest("dumpling", "boil", {"force": Fraction(1, 2)})]
    trial.context.run(PlanStep("dumpling", "boil", {"force": 0.25}))
    assert trial.runtime.requests[1].inputs == {"force": 0.25}


def test_a_skill_that_may_not_start_is_not_submitted() -> None:
    trial = Trial()
    assessment = trial.context.run(step("wrap"))
    assert (assessment.outcome, assessment.failed) == (None, True)
    assert "dough_on_workspace" in assessment.reason
    assert trial.runtime.submitted == []


def test_an_input_may_be_what_the_precondition_asks_for() -> None:
    trial = Trial()
    trial.runtime.state["dumpling_wrapped"] = True
    assert trial.context.run(PlanStep("dumpling", "boil", {"force": 0.0})).failed  # it needs some
    assert trial.runtime.submitted == []


def test_of_a_capability_the_first_that_may_start_runs() -> None:
    trial = Trial()
    fold = skill("fold", outcome("folded", {"dumpling_wrapped": True}))
    ecm = module("dumpling", (*DUMPLING.skills.values(), fold), *DUMPLING.tasks.values())
    trial.runtime.modules = {"dumpling": replace(ecm, capabilities={"close": ("wrap", "fold")})}
    trial.context.run(step("close"))
    assert trial.runtime.submitted == ["fold"]


def test_a_skill_that_no_module_has_is_a_mistake_of_the_architecture() -> None:
    with pytest.raises(MisuseError, match="`dumpling` has no skill `fly`"):
        Trial().context.run(step("fly"))


class Silent(FakeRuntime):
    """Its waits end with nothing."""

    def wait(self, until: float = float("inf")) -> EndedStep | None:
        return None


def test_a_wait_without_end_that_ends_is_a_mistake() -> None:
    with pytest.raises(MisuseError, match="returned nothing without a deadline"):
        Trial(runtime=Silent()).context.run(step("prepare"))


def test_readings_of_one_snapshot_make_one_world() -> None:
    trial = Trial()
    readings = trial.runtime.observe()
    trial.runtime.observe = lambda: readings  # type: ignore[method-assign]
    first = trial.context.world()
    assert trial.context.world() is first
    trial.runtime.clock += 1.0
    later = trial.context.world()
    assert later is not first
    assert later.time == 101.0
    trial.runtime.observe = lambda: dict(readings)  # type: ignore[method-assign]
    assert trial.context.world() is not later


def test_an_architecture_that_never_gives_up_is_ended_and_the_harness_measures_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(trial_context, "MAX_CALLS", 3)
    trial = Trial()
    for _ in range(3):
        trial.context.is_goal_reached()
    with pytest.raises(CallLimitError):
        trial.context.world()
    trial.runtime.state["dumpling_cooked"] = True
    readings, goal = trial.runtime.observe(), trial.context.task.task.goal
    assert is_goal_measured(goal, trial.runtime.site, readings, trial.runtime.now())


# Budgets.


def test_a_budget_of_tries_ends_the_trial_before_a_further_try() -> None:
    trial = Trial({"wrap": ["misaligned"] * 5}, budget=Budget(tries=2))
    run(trial, "prepare", *["recover", "wrap"] * 2, "recover")
    with pytest.raises(BudgetSpentError):
        run(trial, "wrap")
    assert trial.counting.tries == 2
    run(trial, "prepare")  # other skills are not counted


def test_a_budget_of_time_lets_nothing_begin_after_it() -> None:
    trial = Trial(budget=Budget(seconds=103.0))
    run(trial, "prepare")
    trial.runtime.clock = 103.0
    with pytest.raises(BudgetSpentError):
        run(trial, "recover")
    assert trial.runtime.submitted == ["prepare"]


def test_a_skill_that_was_begun_goes_on_until_it_ends_or_is_halted() -> None:
    trial = Trial()
    begun = trial.context.begin(step("prepare"))
    assert not isinstance(begun, StepAssessment)
    ended = begun.wait(100.0)
    assert ended is not None
    assert not ended.failed
    begun = trial.context.begin(step("recover"))
    assert not isinstance(begun, StepAssessment)
    begun.halt()
    assert list(trial.runtime.cancelled.values()) == ["the architecture halts it"]
    assert trial.runtime.under_way == {}

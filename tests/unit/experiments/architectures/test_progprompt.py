"""ProgPrompt-style execution: assertions before steps, and a new plan after each failure."""

from __future__ import annotations

from aeros.experiments.architecture import ArchitectureReport
from aeros.experiments.architectures.progprompt import ProgPrompt
from tests.unit.agent.dumplings import MAKE_DUMPLINGS
from tests.unit.experiments.support.dumpling_trials import Trial


def test_a_plan_that_reaches_the_goal_is_the_only_one() -> None:
    trial = Trial()
    assert ProgPrompt().pursue(trial.context) == ArchitectureReport()
    assert trial.runtime.submitted == ["prepare", "recover", "wrap", "boil"]


def test_after_a_failure_everything_is_planned_again_from_what_is_measured() -> None:
    trial = Trial({"wrap": ["misaligned"]})
    assert ProgPrompt().pursue(trial.context) == ArchitectureReport(replans=1)
    assert trial.runtime.submitted == ["prepare", "recover", "wrap", "recover", "wrap", "boil"]


def test_a_step_whose_effect_is_there_already_is_left_out() -> None:
    trial = Trial(
        {"prepare": [dict.fromkeys(("dough_on_workspace", "filling_on_workspace", "wrapper_aligned"), True)]}
    )
    ProgPrompt().pursue(trial.context)
    assert "recover" not in trial.runtime.submitted


def test_plans_come_to_an_end_with_the_reason_of_the_last() -> None:
    trial = Trial({"wrap": ["misaligned"] * 9})
    report = ProgPrompt(max_plans=2).pursue(trial.context)
    assert report == ArchitectureReport(replans=1, reason="wrap: outcome `misaligned`")
    assert trial.runtime.submitted.count("wrap") == 2


def test_a_plan_that_is_finished_without_the_goal_says_so() -> None:
    from dataclasses import replace

    trial = Trial(task=replace(MAKE_DUMPLINGS, rules=MAKE_DUMPLINGS.rules[:1]))
    report = ProgPrompt(max_plans=3).pursue(trial.context)
    assert report == ArchitectureReport(replans=2, reason="the plan is finished but the goal is not reached")
    assert trial.runtime.submitted == ["prepare"]

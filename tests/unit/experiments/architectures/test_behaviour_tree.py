"""The behaviour tree: conditions, bounded retries, and a recovery before a further try."""

from __future__ import annotations

import pytest

pytest.importorskip("py_trees", reason="needs `pip install '.[experiments]'`")

from aeros.experiments.architecture import ArchitectureReport
from aeros.experiments.architectures.behaviour_tree import BehaviourTree
from tests.unit.experiments.support.dumpling_trials import Trial


def test_every_rule_is_a_step_of_the_sequence() -> None:
    trial = Trial()
    assert BehaviourTree().pursue(trial.context) == ArchitectureReport()
    assert trial.runtime.submitted == ["prepare", "recover", "wrap", "boil"]


def test_a_condition_that_holds_makes_its_skill_needless() -> None:
    trial = Trial()
    trial.runtime.state["wrapper_aligned"] = True
    del trial.runtime.state["dumpling_cooked"]  # unknown holds nothing
    BehaviourTree().pursue(trial.context)
    assert trial.runtime.submitted == ["prepare", "wrap", "boil"]


def test_a_skill_that_fails_is_tried_again_as_often_as_is_allowed() -> None:
    trial = Trial({"boil": ["nothing_changed"] * 2})
    assert BehaviourTree().pursue(trial.context) == ArchitectureReport(retries=2)
    assert trial.runtime.submitted.count("boil") == 3
    trial = Trial({"boil": ["nothing_changed"] * 9})
    report = BehaviourTree(max_tries=2).pursue(trial.context)
    assert report == ArchitectureReport(retries=1, reason="boil: outcome `nothing_changed`")
    assert trial.runtime.submitted.count("boil") == 2


def test_without_recovery_a_try_may_not_be_able_to_start() -> None:
    trial = Trial({"wrap": ["misaligned"]})
    report = BehaviourTree().pursue(trial.context)
    assert (report.retries, report.recoveries) == (2, 0)
    assert "wrapper_aligned" in report.reason
    assert trial.runtime.submitted == ["prepare", "recover", "wrap"]


def test_with_recovery_the_skill_that_helps_runs_before_a_further_try_alone() -> None:
    trial = Trial({"wrap": ["misaligned"] * 2})
    report = BehaviourTree(recovery=True).pursue(trial.context)
    assert report == ArchitectureReport(retries=2, recoveries=2)
    assert trial.runtime.submitted == [
        "prepare",
        "recover",
        "wrap",
        "recover",
        "wrap",
        "recover",
        "wrap",
        "boil",
    ]


def test_a_skill_without_recovery_is_tried_alone() -> None:
    trial = Trial({"boil": ["nothing_changed"]})
    report = BehaviourTree(recovery=True).pursue(trial.context)
    assert report == ArchitectureReport(retries=1)

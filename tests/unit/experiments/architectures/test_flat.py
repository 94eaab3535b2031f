"""The flat pipeline: each step of the first plan once, to the first that fails."""

from __future__ import annotations

from aeros.experiments.architecture import ArchitectureReport
from aeros.experiments.architectures.flat import FlatPipeline
from tests.unit.experiments.support.dumpling_trials import Trial


def test_each_step_runs_once() -> None:
    trial = Trial()
    assert FlatPipeline().pursue(trial.context) == ArchitectureReport()
    assert trial.runtime.submitted == ["prepare", "recover", "wrap", "boil"]


def test_the_first_failure_ends_it() -> None:
    trial = Trial({"wrap": ["misaligned"]})
    report = FlatPipeline().pursue(trial.context)
    assert report == ArchitectureReport(reason="wrap: outcome `misaligned`")
    assert trial.runtime.submitted == ["prepare", "recover", "wrap"]


def test_where_nothing_is_planned_nothing_runs() -> None:
    trial = Trial()
    trial.runtime.state = dict.fromkeys(trial.runtime.state, True)
    assert FlatPipeline().pursue(trial.context) == ArchitectureReport()
    assert trial.runtime.submitted == []

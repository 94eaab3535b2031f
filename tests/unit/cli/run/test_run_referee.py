"""The referee of a run judges each request at the moment at which it ended."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.agent.execution.journal import AgentEvent
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.understand import understand
from aeros.cli.run.run_referee import RunReferee
from aeros.sim.referee import GoalJudgement
from aeros.spec.expr import terms as t
from tests.unit.cli.staged import proved

REACHED = RunReport("tidy", "tidy", "clean_up", "bench_clean", True, {}, (), 0, None)


class Plant:
    """A simulator in which the bench is clean, or not."""

    def __init__(self, **truth: bool) -> None:
        self.truths = truth

    def truth(self) -> dict[str, bool]:
        return dict(self.truths)


def meaning(*, conditional: bool = False) -> Understanding:
    """Two requests: a clean bench, and the opposite of it."""
    found = understand("clean_up", proved()[0].modules)
    (first,) = found.errands
    task = first.routed.task
    second = replace(first.routed, task=replace(task, goal=t.Not(task.goal)))
    condition = task.goal if conditional else None
    return replace(found, errands=(replace(first, condition=condition), replace(first, routed=second)))


def event(kind: str, number: int = 1) -> AgentEvent:
    return AgentEvent(kind, "", {"number": number}, 0.0)


def judged(referee: RunReferee, *events: tuple[str, int, bool]) -> GoalJudgement | None:
    """The judgement after these events, each with whether the bench is clean then."""
    plant = Plant()
    referee.plant = plant
    for kind, number, is_clean in events:
        plant.truths = {"bench_clean": is_clean}
        referee.observe(event(kind, number))
    return referee.judge(REACHED)


FIRST, SECOND, ENDED, SKIPPED = (
    ("task-selected", 1),
    ("task-selected", 2),
    ("run-ended", 0),
    ("errand-skipped", 0),
)


@pytest.mark.parametrize(
    ("at_first_end", "at_last", "true"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_a_later_request_may_undo_an_earlier_one(at_first_end: bool, at_last: bool, true: bool) -> None:
    found = judged(
        RunReferee(meaning(), ()),
        (*FIRST, False), (*ENDED, at_first_end), (*SECOND, at_first_end), (*ENDED, at_last),
    )  # fmt: skip
    assert found is not None
    assert (found.believed, found.true) == (True, true)


def test_the_other_branch_of_a_request_that_was_begun_is_not_judged() -> None:
    found = meaning(conditional=True)
    first, second = found.errands
    branches = replace(found, errands=(first, first.otherwise(second.routed)))
    judgement = judged(RunReferee(branches, ()), (*FIRST, False), (*ENDED, True))
    assert judgement is not None
    assert judgement.true is True


def test_a_request_that_was_skipped_is_not_judged() -> None:
    events = ((*FIRST, False), (*SKIPPED, False), (*ENDED, False), (*SECOND, False), (*ENDED, False))
    found = judged(RunReferee(meaning(conditional=True), ()), *events)
    assert found is not None
    assert found.true is True


def test_if_all_were_skipped_there_is_nothing_to_judge() -> None:
    skipped = ((*FIRST, False), (*SKIPPED, False), (*SECOND, False), (*SKIPPED, False))
    assert judged(RunReferee(meaning(conditional=True), ()), *skipped) is None


@pytest.mark.parametrize(("conditional", "true"), [(False, False), (True, None)])
def test_a_request_that_ended_before_a_crash_is_judged_at_the_end_unless_it_had_a_condition(
    conditional: bool, true: bool | None
) -> None:
    found = judged(RunReferee(meaning(conditional=conditional), ()), (*SECOND, False), (*ENDED, False))
    assert found is not None
    assert found.true is true


def test_a_plant_that_knows_no_truth_has_no_judgement() -> None:
    assert RunReferee(meaning(), (), object()).judge(REACHED) is None

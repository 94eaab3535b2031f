"""AEROS as an architecture: whole, or with parts left out, and predicted with the same parts left out."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, TrialModel
from aeros.experiments.architectures.aeros_agent import AerosAgent
from aeros.spec.closed_loop.giving_up import declared_beliefs
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import Prediction
from aeros.spec.model.ecm import Outcome, Task
from tests.differential.planning.test_giving_up import with_all_failures
from tests.unit.agent.dumplings import (
    PREDICATES,
    module,
    rule,
    site,
    skill,
    task,
)
from tests.unit.experiments.support.dumpling_trials import Trial

START = {**dict.fromkeys(PREDICATES, False), "area": "table"}


def test_the_whole_agent_retries_recovers_and_plans_again() -> None:
    trial = Trial({"wrap": ["misaligned"] * 3})
    report = AerosAgent().pursue(trial.context)
    assert report == ArchitectureReport(retries=2, recoveries=2, replans=1)
    assert trial.runtime.submitted[-2:] == ["wrap", "boil"]


def test_parts_are_left_out_of_what_it_does() -> None:
    trial = Trial({"boil": ["nothing_changed"] * 9})
    report = AerosAgent(retries=0, replans=0).pursue(trial.context)
    assert (report.retries, report.recoveries, report.replans) == (0, 0, 0)
    assert "after 0 re-plans" in report.reason
    trial = Trial({"wrap": ["misaligned"]})
    report = AerosAgent(recovery=False, replans=0).pursue(trial.context)
    assert report.recoveries == 0
    assert trial.runtime.submitted == ["prepare", "recover", "wrap"]


def test_the_gate_decides_by_the_site_itself() -> None:
    trial = Trial()
    AerosAgent(replans=3).pursue(trial.context)
    assert trial.runtime.site.limits.replans == 10


@pytest.mark.parametrize(
    ("agent", "retry", "is_helped"),
    [
        (AerosAgent(), 2, True),
        (AerosAgent(retries=1), 1, True),
        (AerosAgent(retries=5), 2, True),
        (AerosAgent(recovery=False), 2, False),
        (AerosAgent(retries=0, recovery=False), 0, False),
    ],
)
def test_a_step_is_ablated_to_what_is_left(agent: AerosAgent, retry: int, is_helped: bool) -> None:
    between, last = PlanStep("m", "help"), PlanStep("n", "reset")
    left = (between, last) if is_helped else (None, None)
    found = agent.ablate(PlanStep("m", "s", {"f": 1.0}, 2, between, last))
    assert found == PlanStep("m", "s", {"f": 1.0}, retry, *left)


# Predicted: one skill that succeeds in one of two tries.


def _model(retry: int, replans: int, on_failure: str | None = None) -> TrialModel:
    boil = skill(
        "boil",
        Outcome("cooked", {"dumpling_cooked": True}, False, Fraction(1, 2), None),
        Outcome("cold", {}, True, Fraction(1, 2), None),
    )
    stir = skill("stir", Outcome("stirred", {}, False, Fraction(1), None))
    cook: Task = task(
        "cook", ("cook",), "dumpling_cooked", rule("dumpling_cooked", "boil", retry, on_failure)
    )
    at = site(replans=replans)
    return TrialModel(module("m", (boil, stir), cook), replace(cook, initial=START), at)


@pytest.mark.parametrize(
    ("agent", "success"),
    [
        (AerosAgent(), Fraction(15, 16)),  # two plans of two tries
        (AerosAgent(retries=0), Fraction(3, 4)),
        (AerosAgent(replans=0), Fraction(3, 4)),
        (AerosAgent(retries=0, replans=0), Fraction(1, 2)),
        (AerosAgent(planning_timeout=5.0, first_plan_delay_s=1.0), Fraction(15, 16)),
    ],
)
def test_it_predicts_what_is_left_of_it(agent: AerosAgent, success: Fraction) -> None:
    assert agent.predict(_model(retry=1, replans=1)).success == success


def test_without_recovery_none_is_predicted() -> None:
    whole = AerosAgent().predict(_model(1, 0, "stir"))
    without = AerosAgent(recovery=False).predict(_model(1, 0, "stir"))
    assert (whole.recoveries, without.recoveries) == (Fraction(1, 2), Fraction(0))
    assert whole.success == without.success == Fraction(3, 4)


@pytest.mark.parametrize("delays", [(1.0, 2.0), (2.0, 1.0)])
def test_where_no_plan_can_be_ready_no_step_begins(delays: tuple[float, float]) -> None:
    late = AerosAgent(planning_timeout=1.0, first_plan_delay_s=delays[0], replan_delay_s=delays[1])
    assert late.predict(_model(1, 4)) == Prediction(*map(Fraction, (0, 0, 0, 0, 4)))


@pytest.mark.parametrize("delays", [(1.0, 0.0), (0.0, 1.0)])
def test_where_some_plans_are_late_nothing_is_predicted(delays: tuple[float, float]) -> None:
    agent = AerosAgent(planning_timeout=1.0, first_plan_delay_s=delays[0], replan_delay_s=delays[1])
    with pytest.raises(StateSpaceError, match="the rest of the previous plan"):
        agent.predict(_model(1, 1))


@pytest.mark.parametrize(
    ("tries", "success"), [(1, Fraction(1, 2)), (3, Fraction(7, 8)), (9, Fraction(15, 16))]
)
def test_it_predicts_budgets_of_tries(tries: int, success: Fraction) -> None:
    model = _model(retry=1, replans=1, on_failure="stir")
    assert AerosAgent().predict_within(model, "boil", tries).success == success
    assert AerosAgent().predict_within(model, "fry", tries).success == Fraction(15, 16)


def test_the_beliefs_of_the_agent_decide_when_it_gives_up() -> None:
    model = _model(retry=1, replans=10)
    model = replace(model, beliefs=declared_beliefs(with_all_failures(model.ecm, Fraction(1, 10))))
    assert AerosAgent().predict(model).success == 1 - Fraction(1, 2) ** 8

"""The prediction against a tree written separately, and against the agent's own loop.

Exactly: for random small tasks, and for the reference modules, where the real loop is run on every
sequence of outcomes.  By sampling: runs of the real loop, and of the whole runtime on the symbolic plant.
"""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from statistics import fmean, stdev
from typing import Any

import pytest
from hypothesis import assume, given

from aeros.agent.execution.report import RunReport
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import Encoded
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import make_configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import EMPTY_LOG_HEAD, LogHead
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.closed_loop import transition_system
from aeros.spec.closed_loop.markov_chain import Prediction
from aeros.spec.closed_loop.outcome_probabilities import (
    outcome_probabilities,
    with_retries,
    with_skill_probabilities,
)
from aeros.spec.closed_loop.reachability import explore_task
from aeros.spec.closed_loop.transition_system import LoopState, TransitionSystem
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.step_graph import MAX_STEPS
from aeros.spec.verification.certificate import certificate_for
from tests.differential.planning.small_tasks import Case, cases
from tests.differential.planning.tree_expansion import Expected, expected
from tests.differential.real_loop import Run, every_run, pursue, run_with
from tests.differential.reference_cases import (
    REFERENCE,
    as_tuple,
    in_small,
    predicted,
    predicted_without_giving_up,
    reference,
)
from tests.hypothesis_profiles import examples

Z = 3.2905
"""Two-sided 99.9 % of the normal distribution."""


def measured(report: RunReport) -> Expected:
    counts = (report.reached, len(report.steps), report.retries, report.recoveries, report.replans)
    return Expected(*map(Fraction, counts))


def enumerated(case: Case, most: int) -> Expected | None:
    """The mean over every run of the real loop; None where there are more than `most`."""
    system = TransitionSystem(case.ecm, case.task, case.site)
    means, whole = [Fraction(0)] * 5, Fraction(0)
    for number, (probability, run) in enumerate(every_run(case.ecm, case.task, case.site, case.start)):
        if number == most:
            return None
        assert_is_a_path(system, case, run)
        whole += probability
        means = [m + probability * x for m, x in zip(means, measured(run.report), strict=True)]
    assert whole == 1
    return Expected(*means)


def assert_is_a_path(system: TransitionSystem, case: Case, run: Run) -> None:
    """Every step of the run is a move of the transition system, and so is how it ended."""
    here = _silently(system, LoopState("plan", tuple(case.start[name] for name in system.names)))
    for step, state in zip(run.report.steps, run.states, strict=True):
        observed = (step.role.value, f"{step.skill} → {step.outcome}", tuple(state[n] for n in system.names))
        targets = {
            move.target
            for node in here
            for move in system.transitions(node)
            if move.probability and (move.role, move.label, move.target.state) == observed
        }
        assert len(targets) == 1, f"the system knows no such step: {observed}"
        here = _silently(system, targets.pop())
    assert any(node.phase == "reached" for node in here) is run.report.reached


def _silently(system: TransitionSystem, node: LoopState) -> list[LoopState]:
    """`node` and what it leads to without a submission; the loop may plan on, so no node comes twice."""
    found = [node]
    for one in found:
        found += [m.target for m in system.transitions(one) if m.role is None and m.target not in found]
    return found


def test_the_agent_and_the_analysis_accept_plans_of_the_same_length() -> None:
    assert transition_system.MAX_PLAN_STEPS == MAX_STEPS


@examples(60)
@given(cases(most_rules=3, most_retries=2, most_replans=4))
def test_the_prediction_is_what_the_tree_adds_up_to(case: Case) -> None:
    found = as_tuple(predicted_without_giving_up(case))
    assert found == expected(case.ecm, case.task, case.site, case.start)


@examples(40)
@given(cases(most_rules=2, most_retries=1, most_replans=1))
def test_the_prediction_is_the_mean_over_every_run_of_the_real_loop(case: Case) -> None:
    found = enumerated(case, most=200)
    assume(found is not None)
    assert as_tuple(predicted(case)) == found


@examples(40)
@given(cases(most_rules=3, most_retries=2, most_replans=4))
def test_everything_the_real_loop_does_is_in_the_explored_graph(case: Case) -> None:
    explored = explore_task(case.ecm, replace(case.task, initial=case.start), case.site)
    known = {node.state for node in explored.graph}
    pick = random.Random(7).choice  # noqa: S311  no secret depends on it

    def chance(skill: str, names: list[str]) -> str:
        return pick([name for name in names if case.ecm.skills[skill].outcomes[name].probability != 0])

    for _ in range(5):
        run = run_with(case.ecm, case.task, case.site, case.start, chance)
        assert {tuple(state[name] for name in explored.system.names) for state in run.states} <= known
        assert_is_a_path(explored.system, case, run)


@pytest.mark.parametrize("replans", [0, pytest.param(1, marks=pytest.mark.deep)])
@pytest.mark.parametrize("name", REFERENCE)
def test_a_reference_module_is_predicted_as_every_run_of_the_real_loop_has_it(
    name: str, replans: int
) -> None:
    case = in_small(reference(name, replans))
    without = as_tuple(predicted_without_giving_up(case))
    assert without == expected(case.ecm, case.task, case.site, case.start)
    found = enumerated(case, most=5_000)
    assert found is not None
    assert as_tuple(predicted(case)) == found


@pytest.mark.parametrize(
    ("replans", "count"),
    [(1, 500), (10, 100), *(pytest.param(*more, marks=pytest.mark.deep) for more in ((1, 2_000), (10, 500)))],
)
@pytest.mark.parametrize("name", REFERENCE)
def test_runs_of_the_real_loop_come_to_what_is_predicted(name: str, replans: int, count: int) -> None:
    case = in_small(reference(name, replans))
    weights = {
        one.id: [float(share) for _, share in outcome_probabilities(one.outcomes.values())]
        for one in case.ecm.skills.values()
    }
    draw = random.Random(f"{name} {replans}")  # noqa: S311  no secret depends on it

    def chance(skill: str, names: list[str]) -> str:
        return draw.choices(names, weights[skill])[0]

    runs = [run_with(case.ecm, case.task, case.site, case.start, chance) for _ in range(count)]
    system = TransitionSystem(case.ecm, case.task, case.site)
    for run in runs:
        assert_is_a_path(system, case, run)
    assert_within([measured(run.report) for run in runs], predicted(case))


@pytest.mark.parametrize("name", REFERENCE)
def test_runs_of_the_whole_runtime_on_the_symbolic_plant_come_to_what_is_predicted(name: str) -> None:
    case = reference(name, 1)
    certificate = certificate_for(case.ecm, case.site, {})
    configuration = make_configuration(case.site, {case.ecm.id: (case.ecm, certificate)})
    gate = CompiledGate(configuration, GateMode.COMPILED)
    found = []
    for seed in range(25):
        plant = SymbolicPlant(case.site, configuration.modules, seed, to_doubles(case.task.initial))
        executor = Executor(configuration, gate, plant, Unwritten(), run_in_process)
        found.append(measured(pursue(case.ecm, case.task, executor)))
    assert_within(found, predicted(case))


class Unwritten(AuditLog):
    """An audit record that keeps nothing."""

    def __init__(self) -> None:
        pass

    def append(self, event: str, details: Mapping[str, Any] | Encoded) -> int:
        return 0

    @property
    def head(self) -> LogHead:
        return EMPTY_LOG_HEAD


def assert_within(found: list[Expected], prediction: Prediction) -> None:
    """Each mean is within 99.9 % of its prediction."""
    exact, count = as_tuple(prediction), len(found)
    spread = math.sqrt(exact.success * (1 - exact.success) / count)
    assert abs(fmean(one.success for one in found) - exact.success) <= Z * spread + 1e-9
    for name in ("invocations", "retries", "recoveries", "replans"):
        values = [float(getattr(one, name)) for one in found]
        assert abs(fmean(values) - getattr(exact, name)) <= Z * stdev(values) / math.sqrt(count) + 1e-9, name


def test_the_theory_of_retries_without_preconditions_is_met() -> None:
    # 1 - p^(1 + n): what the paper's cells with three tries are in theory.
    for failure, success in ((30, Fraction(973, 1000)), (40, Fraction(936, 1000))):
        case = reference("clean_table", 0)
        wiped = {"wiped": 1 - Fraction(failure, 100)}
        sure = {"organize": {"organized": Fraction(1)}, "verify": {"verified": Fraction(1)}}
        ecm = with_skill_probabilities(case.ecm, {"wipe": wiped, **sure})
        assert predicted(replace(case, ecm=ecm, task=with_retries(case.task, {"wipe": 2}))).success == success

"""The planner without rules in the agent's loop, beside the planner with them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

import pytest

from aeros.agent.memory.experience import ExperiencedEnd, with_experience
from aeros.agent.planning.base import Planner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.smt import SmtPlanner
from aeros.agent.planning.task_graph import PlanStep
from aeros.agent.world.world import world_from_readings
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import make_configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import Reading
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.symbolic.outcomes import draw_outcome
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.verification.certificate import certificate_for
from tests.differential.planning.test_prediction import Unwritten
from tests.differential.real_loop import Recording, pursue
from tests.differential.reference_cases import REFERENCE, in_small, reference


@pytest.mark.parametrize("replans", [0, 1, 10])
@pytest.mark.parametrize("name", REFERENCE)
def test_it_reaches_the_goal_no_less_often_than_the_rules_do(name: str, replans: int) -> None:
    case = in_small(reference(name, replans))
    shares = {key: outcome_probabilities(one.outcomes.values()) for key, one in case.ecm.skills.items()}

    def reached(planner: Planner | None, seed: int) -> bool:
        runs = Counter[str]()

        def chance(skill: str, _: list[str]) -> str:
            runs[skill] += 1
            return draw_outcome(shares[skill], seed, skill, runs[skill]).id

        runtime = Recording(case.ecm, case.site, case.start, chance)
        return pursue(case.ecm, case.task, runtime, planner).reached

    by_rules = sum(reached(None, seed) for seed in range(60))
    by_declarations = sum(reached(SmtPlanner(case.site), seed) for seed in range(60))
    assert by_declarations >= by_rules
    assert by_declarations >= 60 * (0.5 if replans == 0 else 0.8)


@pytest.mark.parametrize("name", REFERENCE)
def test_the_whole_runtime_reaches_each_reference_goal_on_the_symbolic_plant(name: str) -> None:
    case = reference(name, 10)
    configuration = make_configuration(
        case.site, {case.ecm.id: (case.ecm, certificate_for(case.ecm, case.site, {}))}
    )
    gate = CompiledGate(configuration, GateMode.COMPILED)
    log: AuditLog = Unwritten()
    for seed in range(4):
        plant = SymbolicPlant(case.site, configuration.modules, seed, to_doubles(case.task.initial))
        executor = Executor(configuration, gate, plant, log, run_in_process)
        report = pursue(case.ecm, case.task, executor, SmtPlanner(case.site))
        assert report.reached, report.reason


def test_memory_changes_the_plan_where_a_step_takes_longer_than_is_declared() -> None:
    case = reference("fetch_object", 10)
    world = world_from_readings(
        case.site.state, {name: Reading(value, 0.0) for name, value in case.start.items()}, 0.0
    )
    planner, routed = SmtPlanner(case.site), RoutedTask(case.ecm.id, case.task)

    def steps(ends: Mapping[str, Sequence[ExperiencedEnd]]) -> list[str]:
        ecm = with_experience(case.ecm, lambda _, skill, __: ends.get(skill, ()))
        graph = planner.plan(routed, world, {ecm.id: ecm})
        assert re.fullmatch(r"expected \d+ s, risk [\d.e-]+", graph.remark)
        return [one.skill for one in graph.parts if isinstance(one, PlanStep)]

    # Declared here: every skill succeeds with 70 %, so that one long step costs less than two short ones.
    assert steps({})[:2] == ["recover", "grasp"]
    works = {
        "navigate": [ExperiencedEnd("arrived", False, 6.0)] * 50,
        "detect": [ExperiencedEnd("seen", False, 2.0)] * 50,
        "recover": [ExperiencedEnd("ready", False, 18.0)] * 50,
    }
    assert steps(works)[:2] == ["navigate", "detect"]
    assert steps({**works, "navigate": [ExperiencedEnd("arrived", False, 60.0)] * 50})[0] == "recover"

"""The executor with the real gate, monitor and symbolic plant: what the fakes stand in for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditLog, DecisionCounts, verify_log
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import make_configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import StepRequest, StepResult, StepStatus
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.policy import Access
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.verification.certificate import certificate_for

CODE = """
from aeros.skill import act

def lift(observed, inputs):
    speed = 2 * inputs["height"]
    for _ in range(3):
        observed = yield act("move", speed=speed)
        speed = 2 * speed
"""


@pytest.fixture
def executor(site: Site, make_ecm: Any, tmp_path: Path) -> Iterator[Executor]:
    speed = Declared(
        t.Variable("speed", RealType(NUMBER), t.VariableRole.PARAMETER),
        site.span,
        range=(Fraction(0), Fraction(1)),
    )
    everything = ActionCondition(t.TRUE, "true", site.span)
    slow = ActionCondition(
        t.Compare("<=", speed.variable, t.Literal(Fraction(1, 2), RealType(NUMBER))), "", site.span
    )
    arm = Access(actuators=frozenset({"arm"}))
    move = replace(site.kinds["move"], parameters={"speed": speed})
    governed = replace(site, kinds={**site.kinds, "move": move}, access=arm)
    made: Ecm = make_ecm(CODE)
    skill = replace(made.skills["lift"], envelope={"move": slow})
    ecm = replace(made, skills={"lift": skill}, permitted_actions={"move": everything}, requested_access=arm)
    certificate = certificate_for(
        ecm, governed, {ClaimForm.ENVELOPE_OBEYS("lift", "move", "separation"): "GUARDED"}
    )
    configuration = make_configuration(governed, {"handling": (ecm, certificate)})
    plant = SymbolicPlant(governed, configuration.modules, seed=0)
    with AuditLog(tmp_path / "audit.jsonl") as audit:
        yield Executor(
            configuration, CompiledGate(configuration, GateMode.CHECKED), plant, audit, run_in_process
        )


def test_a_step_is_carried_out_and_its_outcome_measured(executor: Executor, tmp_path: Path) -> None:
    request = StepRequest("handling", "lift", {"height": 0.0625})
    assert executor.run_step(request) == StepResult(StepStatus.FINISHED, "", allowed=3)
    assert executor.observe()["holding"].value is True
    assert verify_log(tmp_path / "audit.jsonl").decisions == DecisionCounts(allowed=3)


def test_an_action_outside_the_envelope_ends_the_step_without_an_outcome(executor: Executor) -> None:
    result = executor.run_step(StepRequest("handling", "lift", {}))
    assert (result.status, result.allowed, result.denied) == (StepStatus.DENIED, 2, 1)
    assert result.reason.startswith("AE730 move")
    assert executor.observe()["holding"].value is False


def test_the_quota_runs_out(executor: Executor) -> None:
    request = StepRequest("handling", "lift", {"height": 0.0625})
    assert executor.run_step(request).status is StepStatus.FINISHED
    result = executor.run_step(request)
    assert (result.status, result.allowed) == (StepStatus.DENIED, 2)
    assert "AE742 move-rate" in result.reason

from __future__ import annotations

from fractions import Fraction
from math import nextafter

import pytest

from aeros.runtime.gate.conditions import (
    CompiledCondition,
    ConditionValue,
    DecidableCondition,
    SolverCondition,
)
from aeros.spec.backends import z3_solver
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from tests.unit.runtime.bench import configuration

KINDS = (CompiledCondition, SolverCondition)


def condition(
    rule: str, kind: str, make: type[CompiledCondition] | type[SolverCondition]
) -> DecidableCondition:
    site = configuration().site
    (found,) = [one for one in site.rules if one.id == rule]
    return make(found.terms[kind], (*site.state.values(), *site.kinds[kind].parameters.values()))


@pytest.mark.parametrize("make", KINDS)
def test_a_condition_names_every_scalar_of_the_variables_it_reads(
    make: type[CompiledCondition] | type[SolverCondition],
) -> None:
    assert condition("momentum", "carry", make).names == {"load", "gait"}
    assert condition("some-joint-ready", "carry", make).names == {
        "joint_ready[shoulder]",
        "joint_ready[elbow]",
    }
    assert condition("knife-speed", "move", make).names == {"fitted", "speed"}


@pytest.mark.parametrize("make", KINDS)
def test_values_that_a_condition_does_not_read_are_ignored(
    make: type[CompiledCondition] | type[SolverCondition],
) -> None:
    momentum = condition("momentum", "carry", make)
    assert momentum.decide({"load": 1.0, "gait": 0.0625, "hand": object()}) is ConditionValue.HOLDS


@pytest.mark.parametrize("make", KINDS)
@pytest.mark.parametrize("gait", [0.1, nextafter(0.1, 0.0), nextafter(0.1, 1.0), -0.0, 5e-324])
def test_a_bound_is_compared_as_an_exact_rational(
    gait: float, make: type[CompiledCondition] | type[SolverCondition]
) -> None:
    expected = ConditionValue.HOLDS if Fraction(gait) <= Fraction(1, 10) else ConditionValue.FAILS
    assert condition("slow-carry", "carry", make).decide({"gait": gait}) is expected


def test_a_solver_out_of_budget_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    starved = condition("momentum", "carry", SolverCondition)
    unknown = SolverAnswer(SatResult.UNKNOWN, {}, "out of resources")
    monkeypatch.setattr(z3_solver.IncrementalSolver, "check_at_values", lambda *_: unknown)
    assert starved.decide({"load": 1.0, "gait": 0.0625}) is ConditionValue.UNDECIDED


def test_a_session_that_is_asked_again_answers_for_the_new_values() -> None:
    momentum = condition("momentum", "carry", SolverCondition)
    answers = [momentum.decide({"load": load, "gait": 0.0625}) for load in (1.0, 2.0, 1.0, 4.0)]
    assert answers == [ConditionValue.HOLDS, ConditionValue.FAILS, ConditionValue.HOLDS, ConditionValue.FAILS]

"""A question takes no longer than its time limit, also where the solver does not look at it."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from fractions import Fraction

import pytest

from aeros.spec.backends.solver_process import SolverProcess
from aeros.spec.backends.solver_results import SatResult
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER

X, Y = (t.Variable(name, RealType(NUMBER), t.VariableRole.STATE) for name in "xy")
RANGES = {name: (Fraction(-9), Fraction(9)) for name in "xy"}
START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from aeros.spec.backends.solver_process import *; "
)
DEAF = START + "answer_questions(lambda *_: 10 ** 10 ** 8)"  # one call of C, which no handler interrupts
CRASHING = START + "import os; answer_questions(lambda *_: os._exit(7))"
SILENT = "import sys; sys.exit(3)"


def product_above(bound: int) -> t.Term:
    return t.Compare("<", t.Literal(Fraction(bound), RealType(NUMBER)), t.Multiply(X, Y))


@pytest.fixture
def solver() -> Iterator[SolverProcess]:
    one = SolverProcess()
    yield one
    one._end()


def ask(solver: SolverProcess, bound: int, seconds: float = 10.0) -> SatResult:
    return solver.check_sat([X, Y], RANGES, [product_above(bound)], 1_000_000, seconds).result


def test_questions_are_answered_one_after_the_other_by_one_process(solver: SolverProcess) -> None:
    found = solver.check_sat([X, Y], RANGES, [product_above(80)], 1_000_000, 10.0)
    assert found.result is SatResult.SAT
    x, y = found.model["x"], found.model["y"]
    assert isinstance(x, Fraction)
    assert isinstance(y, Fraction)
    assert x * y > 80
    first = solver._process
    assert ask(solver, 81) is SatResult.UNSAT
    assert solver._process is first


def test_a_solver_that_does_not_listen_is_ended_and_the_next_question_is_answered(
    solver: SolverProcess,
) -> None:
    deaf = SolverProcess(DEAF)
    started = time.monotonic()
    found = deaf.check_sat([X], RANGES, [], 1, 0.1)
    assert (found.result, found.reason) == (SatResult.UNKNOWN, "no answer within 0.1 s")
    assert time.monotonic() - started < 20
    assert deaf._process is None
    assert ask(solver, 80) is SatResult.SAT


def test_a_process_that_was_killed_is_started_anew(solver: SolverProcess) -> None:
    assert ask(solver, 80) is SatResult.SAT
    assert solver._process is not None
    os.kill(solver._process.pid, signal.SIGKILL)
    solver._process.wait()
    assert ask(solver, 81) is SatResult.UNSAT


@pytest.mark.parametrize(
    ("program", "reason"),
    [(CRASHING, "the solver's process has ended (7)"), (SILENT, "the solver does not start")],
)
def test_a_process_that_ends_by_itself_leaves_the_question_undecided(program: str, reason: str) -> None:
    found = SolverProcess(program).check_sat([X], RANGES, [], 1, 5.0)
    assert (found.result, found.reason) == (SatResult.UNKNOWN, reason)

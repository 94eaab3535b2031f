from __future__ import annotations

import pytest

from aeros.spec.backends.solver_results import NoAnswerError, SatResult
from aeros.spec.backends.z3_scripts import solve_script, truths_at

_BETWEEN = "(set-logic ALL)(declare-const x Real)(assert (< 0.0 x))(assert (< x {}))(check-sat)"


def test_a_script_is_solved_with_a_model_or_a_core() -> None:
    possible = solve_script("(declare-const x Real)\n(assert (= x 2.0))\n(check-sat)")
    assert (possible.result, dict(possible.model)) == (SatResult.SAT, {"x": "2.0"})
    impossible = solve_script(_BETWEEN.format("0.0"))
    assert (impossible.result, impossible.unsat_core) == (SatResult.UNSAT, 2)
    assert solve_script("(assert").result is SatResult.UNKNOWN


def test_each_assertion_is_evaluated_at_each_point() -> None:
    points = [{"x": "0.5"}, {"x": "(/ 1.0 1000000000000000000000.0)"}, {"x": "0.0"}, {"x": "2.0"}]
    assert truths_at(_BETWEEN.format("1.0"), points) == [
        [True, True], [True, True], [False, True], [True, False]
    ]  # fmt: skip


def test_a_constant_without_a_value_leaves_the_truth_open() -> None:
    assert truths_at(_BETWEEN.format("1.0"), [{}]) == [[None, None]]


def test_a_script_without_assertions_has_no_truths() -> None:
    assert truths_at("(check-sat)", [{}, {}]) == [[], []]


def test_a_script_that_cannot_be_read_is_refused() -> None:
    with pytest.raises(NoAnswerError):
        truths_at("(assert", [])

from __future__ import annotations

import pytest

from aeros.spec.backends.cvc5_solver import Cvc5
from aeros.spec.backends.solver_results import SatResult

_BETWEEN = "(set-logic ALL)(declare-fun x () Real)(assert (< 0 x {}))(check-sat)"
_HARD = """(set-logic ALL)
(declare-fun x () Real)(declare-fun y () Real)(declare-fun z () Real)
(assert (< (- 9) x 9))(assert (< (- 9) y 9))(assert (< (- 9) z 9))
(assert (= (* x x y) (+ 1 (* z z z z y))))
(assert (= (+ (* x x x) (* y y y) (* z z z)) (+ 33 (* 3 x y z))))
(check-sat)"""


def test_sat_and_unsat_are_distinguished() -> None:
    solver = Cvc5()
    asked = ["1", "0", "1", "0"]  # what was asked before changes nothing
    assert [solver.solve_script(_BETWEEN.format(bound)).result.value for bound in asked] == [
        "sat", "unsat", "sat", "unsat"
    ]  # fmt: skip


def test_a_budget_that_runs_out_is_undecided_with_a_reason() -> None:
    message = Cvc5(rlimit=10_000).solve_script(_HARD)
    assert message.result is SatResult.UNKNOWN
    assert "RESOURCEOUT" in message.reason


@pytest.mark.parametrize("script", ["", "(assert", "(assert (< y 0))(check-sat)", "(set-logic ALL)"])
def test_a_script_that_cannot_be_read_is_undecided(script: str) -> None:
    assert Cvc5().solve_script(script).result is SatResult.UNKNOWN

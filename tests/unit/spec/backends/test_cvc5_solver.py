from __future__ import annotations

import cvc5
import pytest

from aeros.spec.backends import cvc5_solver
from aeros.spec.backends.cvc5_solver import Cvc5, truths_at
from aeros.spec.backends.solver_process import SolverProcess
from aeros.spec.backends.solver_results import NoAnswerError, SatResult, SolverAnswer

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


def test_each_assertion_is_evaluated_at_each_point() -> None:
    script = "(set-logic ALL)(declare-const x Real)(assert (< 0 x))(assert (< x 1.0))(check-sat)"
    points = [{"x": "0.5"}, {"x": "(/ 1.0 1000000000000000000000.0)"}, {"x": "0.0"}, {"x": "2.0"}, {}]
    assert truths_at(script, points) == [
        [True, True], [True, True], [False, True], [True, False], [None, None]
    ]  # fmt: skip


def test_text_that_cannot_be_read_is_not_evaluated() -> None:
    with pytest.raises(NoAnswerError, match="Expected SMT-LIBv2 term"):
        truths_at("(assert", [])


def test_an_answer_has_a_result_no_model_and_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Cvc5().name == f"cvc5 {cvc5.__version__}"
    for script, expected in (("(assert true)", SatResult.SAT), ("(assert false)", SatResult.UNSAT)):
        answer = cvc5_solver._solve_script(f"(set-logic ALL)\n{script}\n(check-sat)", 1_000_000)
        assert answer == SolverAnswer(expected, {})
    unasked = cvc5_solver._solve_script("(set-logic ALL)", 1_000_000)
    assert unasked == SolverAnswer(SatResult.UNKNOWN, {}, "")
    unread = cvc5_solver._solve_script("(assert", 1_000_000)
    assert unread == SolverAnswer(SatResult.UNKNOWN, {}, unread.reason)
    assert "Expected SMT-LIBv2 term" in unread.reason

    def refuse(*given: object, seconds: float) -> SolverAnswer:
        raise NoAnswerError(f"no answer within {seconds:g} s")

    monkeypatch.setattr(SolverProcess, "ask", refuse)
    found = Cvc5().solve_script("(check-sat)")
    assert found == SolverAnswer(SatResult.UNKNOWN, {}, f"no answer within {cvc5_solver._SECONDS:g} s")

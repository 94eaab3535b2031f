"""Answers of solvers."""

from __future__ import annotations

from aeros.spec.backends.solver_results import SatResult, SolverAnswer, timeout_answer


def test_the_answer_to_a_question_that_took_too_long_names_the_limit() -> None:
    assert timeout_answer(10.0) == SolverAnswer(SatResult.UNKNOWN, {}, "no answer within 10 s")
    assert timeout_answer(0.5).reason == "no answer within 0.5 s"

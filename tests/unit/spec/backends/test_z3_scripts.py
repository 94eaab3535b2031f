from __future__ import annotations

import pytest
import z3

from aeros.spec.backends.solver_results import NoAnswerError, SatResult, ScriptAnswer
from aeros.spec.backends.z3_scripts import solve_script, truths_at

_BETWEEN = "(set-logic ALL)(declare-const x Real)(assert (< 0.0 x))(assert (< x {}))(check-sat)"


def test_a_script_is_solved_with_a_model_or_a_core() -> None:
    possible = solve_script("(declare-const x Real)\n(assert (= x 2.0))\n(check-sat)")
    assert (possible.result, dict(possible.model)) == (SatResult.SAT, {"x": "2.0"})
    impossible = solve_script(_BETWEEN.format("0.0"))
    assert (impossible.result, impossible.unsat_core) == (SatResult.UNSAT, 2)
    for answer, expected in (
        (possible, ScriptAnswer(SatResult.SAT, {"x": "2.0"}, 0, possible.rlimit_used)),
        (impossible, ScriptAnswer(SatResult.UNSAT, {}, 2, impossible.rlimit_used)),
    ):
        assert answer == expected
        assert 0 < answer.rlimit_used < 10_000
    unread = solve_script("(assert")
    assert unread == ScriptAnswer(SatResult.UNKNOWN, {}, 0, 0, unread.reason)
    assert "line 1" in unread.reason


def test_a_model_has_the_declared_constants_alone() -> None:
    script = "(declare-const x Real)\n(define-fun f ((y Real)) Real (+ y 1.0))\n(declare-const |b c| Bool)\n"
    found = solve_script(f"{script}(declare-fun g (Real) Real)\n(assert (= (f x) (g x) 2.0))\n(check-sat)")
    assert found.model == {"x": "1.0"}


def test_a_script_that_takes_more_than_its_budget_is_undecided() -> None:
    numbers = " ".join(f"(declare-const x{n} Int)" for n in range(3))
    cubes = "(assert (= (+ (* x0 x0 x0) (* x1 x1 x1) (* x2 x2 x2)) 114))(check-sat)"
    found = solve_script(numbers + cubes, 50_000)
    assert found == ScriptAnswer(SatResult.UNKNOWN, {}, 0, found.rlimit_used, found.reason)
    assert found.rlimit_used >= 50_000
    assert found.reason
    assert solve_script(numbers + cubes, 50_000) == found


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
    with pytest.raises(NoAnswerError, match="line 1"):
        truths_at("(assert", [])


def test_a_script_has_a_context_a_seed_and_a_budget_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[tuple[str, object]] = []
    monkeypatch.setattr(z3.Solver, "set", lambda solver, name, value: given.append((name, value)))
    assert solve_script("(assert false)(check-sat)", 123).result is SatResult.UNSAT
    assert given == [("random_seed", 0), ("rlimit", 123)]
    monkeypatch.setattr(z3.z3, "main_ctx", lambda: pytest.fail("the context of the process is used"))
    assert solve_script("(assert false)(check-sat)").result is SatResult.UNSAT
    assert truths_at(_BETWEEN.format("1.0"), [{"x": "0.5"}]) == [[True, True]]

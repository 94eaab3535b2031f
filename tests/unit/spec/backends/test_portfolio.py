from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.spec.backends import portfolio
from aeros.spec.backends.portfolio import decide
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer, timeout_answer
from aeros.spec.backends.violation_search import SearchResult
from aeros.spec.backends.z3_solver import IncrementalSolver
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL

_RANGES = dict.fromkeys(
    ("x", "y", *(f"{one}.{axis}" for one in "pq" for axis in "xyz")), (Fraction(-10), Fraction(10))
)
_NORMS = ("norm(p) <= 1 m", "norm(q) <= 2 m")
_UNKNOWN = SolverAnswer(SatResult.UNKNOWN, {}, "not today")


def question(*texts: str) -> Question:
    terms = [check(parse(text), Scope(VARIABLES), BOOL) for text in texts]
    return Question(list(t.variables_of(t.And(tuple(terms))).values()), _RANGES, terms)


def alone(way: Callable[..., SolverAnswer | None], asked: Question) -> SolverAnswer:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(portfolio, "_WAYS", (way,))
        return decide(asked, DEFAULT_RLIMIT, 10.0)


@pytest.mark.parametrize(
    ("way", "texts", "result"),
    [
        (portfolio._directly, ("x > 1 m", "x < y"), SatResult.SAT),
        (portfolio._directly, (*_NORMS, "dot(p, q) > 2 m*m"), SatResult.UNKNOWN),
        (portfolio._from_a_point, (*_NORMS, "dot(p, q) > 2 m*m"), SatResult.UNSAT),
        (portfolio._from_a_point, (*_NORMS, "dot(p, q) > 1.99 m*m"), SatResult.SAT),
        (portfolio._by_cells, ("x * y == 2 m*m", "x == y"), SatResult.SAT),
        (portfolio._by_cells, ("x * x * y * y < 0 m*m*m*m",), SatResult.UNSAT),
    ],
)
def test_each_way_decides_what_it_is_for(
    way: Callable[..., SolverAnswer | None], texts: tuple[str, ...], result: SatResult
) -> None:
    asked = question(*texts)
    answer = alone(way, asked)
    assert answer.result is result
    assert bool(answer.model) is (result is SatResult.SAT)


def test_a_point_that_is_found_counts_only_if_z3_confirms_it(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = question("x > 1 m")
    monkeypatch.setattr(portfolio, "search", lambda _: SearchResult({"x": Fraction(0)}, {}))
    assert alone(portfolio._from_a_point, asked).result is SatResult.UNKNOWN
    monkeypatch.setattr(portfolio, "search", lambda _: SearchResult({"x": Fraction(2)}, {}))
    assert alone(portfolio._from_a_point, asked).result is SatResult.SAT


def test_without_an_answer_the_first_reason_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    other = SolverAnswer(SatResult.UNKNOWN, {}, "nor tomorrow")
    monkeypatch.setattr(portfolio, "_WAYS", (lambda *_: _UNKNOWN, lambda *_: None, lambda *_: other))
    assert decide(question("x > 1 m"), 1, 10.0) == _UNKNOWN


def test_a_way_that_is_out_of_time_leaves_time_for_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    late = timeout_answer(4.0)
    decided = SolverAnswer(SatResult.UNSAT, {})
    monkeypatch.setattr(portfolio, "_WAYS", (lambda *_: late, lambda *_: decided))
    assert decide(question("x > 1 m"), 1, 10.0) == decided
    monkeypatch.setattr(portfolio, "_WAYS", (lambda *_: late, lambda *_: _UNKNOWN))
    assert decide(question("x > 1 m"), 1, 10.0) == timeout_answer(10.0)


def test_each_way_has_two_fifths_of_the_time_or_what_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock, limits = [100.0], []

    class Noted(IncrementalSolver):
        def __init__(self, *given: Any, seconds: float) -> None:
            limits.append(seconds)
            super().__init__(*given, seconds=seconds)

    def slow(*_: object) -> SolverAnswer:
        clock[0] += 4.75
        return _UNKNOWN

    monkeypatch.setattr(portfolio, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    monkeypatch.setattr(portfolio, "IncrementalSolver", Noted)
    monkeypatch.setattr(portfolio, "_WAYS", (slow,) * 9)
    assert decide(question("x > 1 m"), 1, 10.0) == _UNKNOWN
    assert limits == [4.0, 4.0, 0.5]
    monkeypatch.setattr(portfolio, "_WAYS", ())
    assert decide(question("x > 1 m"), 1, 10.0) == timeout_answer(10.0)
    monkeypatch.setattr(portfolio, "_WAYS", (slow,))
    assert decide(question("x > 1 m"), 1, 0.0) == timeout_answer(0.0)


def test_ways_use_the_ranges_the_lemmas_and_the_tactic_that_they_are_named_after(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked, lemma, given = question("x * y <= 4 m*m"), t.TRUE, []

    nearest = {"x": 1.0, "y": 2.0}

    def lemmas(terms: object, ranges: object, near: object) -> list[t.Term]:
        assert (terms, ranges, near) == (asked.terms, asked.ranges, nearest)
        return [lemma]

    def noted(_: object, terms: Sequence[t.Term], tactic: str = "default") -> SolverAnswer:
        given.append((list(terms), tactic))
        return _UNKNOWN

    monkeypatch.setattr(portfolio, "search", lambda _: SearchResult(None, nearest))
    monkeypatch.setattr(portfolio, "lemmas_for", lemmas)
    monkeypatch.setattr(IncrementalSolver, "check_simplified", noted)
    for way in (portfolio._from_a_point, portfolio._by_cells):
        assert alone(way, asked) == _UNKNOWN
    assert given == [([*asked.terms, lemma], "default"), (list(asked.terms), "qfnra-nlsat")]

from __future__ import annotations

from fractions import Fraction
from itertools import count

import pytest

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.symbolic_execution import (
    DecideBranch,
    DecisionNode,
    SymbolicValue,
    execute_symbolically,
    path_for_answers,
    questions_in,
    smtlib_definitions,
)


def test_every_way_is_gone_once_and_ends_in_its_result() -> None:
    gone: list[str] = []

    def run(ask: DecideBranch) -> str:
        result = ("a" if ask("p") else "b") + ("c" if ask("q") else "d")
        gone.append(result)
        return result

    found = execute_symbolically(run)
    assert gone == ["ac", "ad", "bc", "bd"]
    answers = [{"p": p, "q": q} for p in (True, False) for q in (True, False)]
    assert [path_for_answers(found, one)[1] for one in answers] == gone


def test_branches_that_make_no_difference_are_not_in_the_diagram() -> None:
    assert execute_symbolically(lambda ask: f"{len([ask('p'), ask('q')])}") == "2"
    assert execute_symbolically(lambda ask: f"{[ask('p'), ask('q')][1]}") == DecisionNode(
        "q", "True", "False"
    )


def test_a_question_is_asked_once_on_a_way() -> None:
    assert execute_symbolically(lambda ask: str(ask("p") == ask("p"))) == "True"


def test_parts_that_are_equal_are_one() -> None:
    found = execute_symbolically(lambda ask: str(sum(map(ask, "pqr"))))
    assert len(smtlib_definitions(found, "sum", "Int")) == 1 + 2 + 3 + 1
    assert questions_in(found) == ("p", "q", "r")


def test_code_that_asks_otherwise_the_second_time_is_noticed() -> None:
    number = count()
    with pytest.raises(InternalError, match="where the run before asked"):
        execute_symbolically(lambda ask: str(ask(f"p{next(number)}") and ask("q")))


def test_code_that_asks_less_the_second_time_is_noticed() -> None:
    number = count()

    def run(ask: DecideBranch) -> str:
        return str(next(number) > 0 or (ask("p") and ask("q")))

    with pytest.raises(InternalError, match="ended where the run before asked `p`"):
        execute_symbolically(run)


def test_an_expected_exception_has_a_result() -> None:
    def run(ask: DecideBranch) -> str:
        return ["fine"][not ask("p")]

    assert execute_symbolically(run, raising="raises") == DecisionNode("p", "fine", "raises")
    with pytest.raises(IndexError):
        execute_symbolically(run)


def test_symbols_become_formulas() -> None:
    asked: list[str] = []

    def ask(question: str) -> bool:
        asked.append(question)
        return True

    x, y = SymbolicValue("x", ask), SymbolicValue("y", ask)
    for condition in (x + 1 < y, 2 - x >= y * Fraction(1, 2), x != y, 0.5 < -x, -3 == x):  # noqa: SIM300
        assert condition
    assert asked == [
        "(< (+ x 1) y)",
        "(<= (* y (/ 1 2)) (- 2 x))",
        "(not (= x y))",
        "(< (/ 1 2) (- x))",
        "(= x (- 3))",
    ]


def test_a_symbol_in_a_message_is_its_term() -> None:
    assert f"{SymbolicValue('x', lambda _: True):.3g} s" == "x s"


def test_a_symbol_is_neither_hashed_nor_compared_with_what_no_formula_speaks_of() -> None:
    x = SymbolicValue("x", lambda _: True)
    with pytest.raises(TypeError):
        x in {"a", "b"}  # noqa: B015
    with pytest.raises(InternalError, match="no formula speaks of"):
        x == "a"  # noqa: B015

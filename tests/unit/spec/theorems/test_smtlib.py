"""Formulas are written as SMT-LIB has them, and constants are worked out."""

from __future__ import annotations

import itertools
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.theorems.smtlib import (
    FALSE,
    TRUE,
    smt_and,
    smt_apply,
    smt_implies,
    smt_literal,
    smt_not,
    smt_or,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (False, "false"),
        (0, "0"),
        (7, "7"),
        (-7, "(- 7)"),
        (Fraction(1, 3), "(/ 1 3)"),
        (Fraction(-1, 3), "(- (/ 1 3))"),
        (Fraction(2), "(/ 2 1)"),
        (Fraction(0), "(/ 0 1)"),
    ],
)
def test_a_constant_is_written_without_a_sign_of_its_own(value: bool | int | Fraction, text: str) -> None:
    assert smt_literal(value) == text


def test_a_negation_of_a_constant_is_the_other() -> None:
    assert [smt_not(one) for one in ("p", TRUE, FALSE, "(not p)")] == [
        "(not p)",
        FALSE,
        TRUE,
        "(not (not p))",
    ]


def test_formulas_are_joined_each_once() -> None:
    assert smt_and(["p", "q", "p"]) == "(and p q)"
    assert smt_or(iter(["p", "q", "p"])) == "(or p q)"
    assert smt_and(["p", "p"]) == smt_or(["p"]) == "p"


def test_constants_are_left_out_or_decide() -> None:
    assert (smt_and([]), smt_or([])) == (TRUE, FALSE)
    assert (smt_and([TRUE, TRUE]), smt_or([FALSE])) == (TRUE, FALSE)
    assert (smt_and(["p", TRUE]), smt_or([FALSE, "p"])) == ("p", "p")
    assert (smt_and(["p", FALSE, "q"]), smt_or(["p", TRUE])) == (FALSE, TRUE)


@given(st.lists(st.sampled_from(["p", "q", TRUE, FALSE]), max_size=4))
def test_conjunctions_and_disjunctions_have_the_truth_of_their_parts(parts: list[str]) -> None:
    def truth(formula: str, at: dict[str, bool]) -> bool:
        words = formula.replace("(", "").replace(")", "").split()
        every = [at[word] for word in words if word in at]
        return all(every) if words[0] == "and" else any(every)

    for p, q in itertools.product((True, False), repeat=2):
        at = {"p": p, "q": q, TRUE: True, FALSE: False}
        assert truth(smt_and(parts), at) is all(at[one] for one in parts)
        assert truth(smt_or(parts), at) is any(at[one] for one in parts)


def test_functions_are_applied_and_implications_written() -> None:
    assert smt_apply("f", "x", "(g y)") == "(f x (g y))"
    assert smt_apply("f") == "f"
    assert smt_implies("p", "q") == "(=> p q)"

"""Claims on norms, products, counts and long sums: Z3 decides each within its budget, and cvc5 agrees."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
import yaml

from aeros.spec.backends.cvc5_solver import Cvc5
from aeros.spec.backends.oracle import Oracle, SolverQuery
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables, values_by_variable
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.verification.second_opinion.cross_check import cross_check_queries

_CASES = yaml.safe_load((Path(__file__).parent / "data" / "hard_questions.yaml").read_text())
_METRES = RealType(LENGTH)
_SETS = {
    name: EnumType(name, tuple(f"m{number}" for number in range(size)))
    for name, size in (("Three", 3), ("Five", 5), ("Forty", 40), ("Hundred", 100))
}
_TYPES: dict[str, Type] = {
    **dict.fromkeys("pqr", VectorType(LENGTH)),
    **dict.fromkeys("sd", _METRES),
    **dict.fromkeys("uv", FamilyType(_SETS["Three"], _METRES)),
    **dict.fromkeys("wz", FamilyType(_SETS["Five"], _METRES)),
    "load": FamilyType(_SETS["Forty"], _METRES),
    "full": FamilyType(_SETS["Forty"], BOOL),
    "mass": FamilyType(_SETS["Hundred"], _METRES),
}
_SCOPE = Scope(
    {name: t.Variable(name, type_, t.VariableRole.STATE) for name, type_ in _TYPES.items()}, enums=_SETS
)


def question_of(case: dict[str, Any]) -> Question:
    terms = [check(parse(text), _SCOPE, BOOL) for text in case["given"]]
    terms.append(t.Not(check(parse(case["claim"]), _SCOPE, BOOL)))
    variables = list(t.variables_of(t.And(tuple(terms))).values())
    names = [part.name for one in variables for part in scalar_variables(one)]
    return Question(variables, dict.fromkeys(names, (Fraction(-10), Fraction(10))), terms)


def _named(cases: list[dict[str, Any]]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("case", cases, ids=[f"{one['claim']} {one['holds']}" for one in cases])


@_named(_CASES)
def test_a_claim_that_a_person_sees_at_once_is_decided(case: dict[str, Any]) -> None:
    question = question_of(case)
    answer = Oracle().check_sat(*question)
    assert answer.result is (SatResult.UNSAT if case["holds"] else SatResult.SAT), answer.reason
    if answer.result is SatResult.SAT:
        point = values_by_variable(question.variables, answer.model)
        assert all(is_true(term, point) for term in question.terms)


_BY_BOTH = ("dot", "sum(u", "sum(load", "norm(p + q) <= s")
_BY_Z3_ALONE = ("sum(load[j] for j in Forty) <= 6.33 m",)  # cvc5's budget ends


@_named(
    [
        one
        for one in _CASES
        if one["holds"] and one["claim"].startswith(_BY_BOTH) and one["claim"] not in _BY_Z3_ALONE
    ]
)
def test_the_second_solver_agrees_by_the_same_lemmas(case: dict[str, Any]) -> None:
    asked = SolverQuery("it", question_of(case), SolverAnswer(SatResult.UNSAT, {}))
    assert cross_check_queries([asked], Cvc5(), lambda _: None).undecided_queries == ()

"""The second solver answers questions as Z3 does, by a text that the translation to Z3 does not share."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given

from aeros.spec.backends.cvc5_solver import Cvc5
from aeros.spec.backends.smtlib import question_script
from aeros.spec.backends.solver_results import Question, SatResult
from aeros.spec.backends.z3_solver import IncrementalSolver
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.lower import scalar_variables, values_by_scalar
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_conditions import ConditionCase, cases, exact_environment
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import AxisAlignedBox, Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from tests.hypothesis_profiles import examples


def _answer(question: Question) -> str:
    return Cvc5().solve_script(question_script(question)).result.value


@examples(30)
@given(cases())
def test_cvc5_decides_random_cases_as_the_definition(case: ConditionCase) -> None:
    scalars = values_by_scalar(VARIABLES, exact_environment(case.values))
    fixed = [
        t.Compare("==", scalar, constant_term(scalars[scalar.name], scalar.type))
        for variable in VARIABLES.values()
        for scalar in scalar_variables(variable)
    ]
    expected = "sat" if is_true(case.term, exact_environment(case.values)) else "unsat"
    assert _answer(Question([*VARIABLES.values()], case.ranges, [case.term, *fixed])) == expected


_RULES = [
    ("x + y <= 2 m and x > 1 m and y > 1 m", SatResult.UNSAT),
    ("x + y <= 2 m and x >= 1 m and y >= 1 m", SatResult.SAT),
    ("all(joint[j] <= 1 m for j in Joint) and joint[arm] > 1 m", SatResult.UNSAT),
    ("any(joint[j] > 1 m for j in Joint) and joint[arm] <= 1 m", SatResult.SAT),
    ("p in cell and norm(p) > 2 m", SatResult.UNSAT),
    ("abs(x) < max(x, -x)", SatResult.UNSAT),
    ("mode in {idle, stop} and mode != idle and not mode == stop", SatResult.UNSAT),
    ("clamp(x, 0 m, 1 m) > 1 m", SatResult.UNSAT),
]


@pytest.mark.parametrize(("text", "expected"), _RULES)
def test_both_solvers_agree_on_a_rule_over_all_states(text: str, expected: SatResult) -> None:
    ten = Fraction(10)
    scope = Scope(
        VARIABLES,
        enums={"Joint": VARIABLES["arm"].type, "Mode": VARIABLES["mode"].type},  # type: ignore[dict-item]
        volumes={"cell": AxisAlignedBox((-Fraction(1),) * 3, (Fraction(1),) * 3)},
    )
    term = check(parse(text), scope, BOOL)
    variables = t.variables_of(term).values()
    names = [scalar.name for variable in variables for scalar in scalar_variables(variable)]
    question = Question([*variables], dict.fromkeys(names, (-ten, ten)), [term])
    assert IncrementalSolver(question.variables, question.ranges).check_sat(term).result is expected
    assert _answer(question) == expected.value


def test_every_kind_of_number_reaches_the_second_solver() -> None:
    x = VARIABLES["x"]
    far = Fraction(10) ** 41
    for value in (Fraction(1, 3), Fraction(5e-324), Fraction(-(10**40)), Fraction(0)):
        literal = constant_term(value, x.type)
        equal, less = t.Compare("==", x, literal), t.Compare("<", x, literal)
        ranges = {"x": (-far, far)}
        assert _answer(Question([x], ranges, [equal])) == "sat"
        assert _answer(Question([x], ranges, [equal, less])) == "unsat"

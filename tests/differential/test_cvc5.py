"""A second solver reads the same SMT-LIB text as Z3 and answers the same."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given

from aeros.spec.backends import z3_solver
from aeros.spec.backends.cvc5_solver import Cvc5
from aeros.spec.backends.solver_results import Result
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables, scalars_of
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_conditions import VARIABLES, Case, cases, exact_environment
from aeros.spec.expr.scope import Box, Scope
from aeros.spec.expr.semantics import holds
from aeros.spec.expr.typecheck import check
from aeros.spec.expr.types import BOOL
from tests.hypothesis_profiles import examples


def _answer(text: str) -> str:
    return Cvc5().answer(text).result.value


@examples(30)
@given(cases())
def test_cvc5_decides_random_cases_as_the_definition(case: Case) -> None:
    session = z3_solver.Session(VARIABLES.values(), case.ranges)
    scalars = scalars_of(VARIABLES, exact_environment(case.values))
    fixed = [
        t.Compare("==", scalar, t.Literal(scalars[scalar.name], scalar.type))  # type: ignore[arg-type]
        for variable in VARIABLES.values()
        for scalar in scalar_variables(variable)
    ]
    expected = "sat" if holds(case.term, exact_environment(case.values)) else "unsat"
    assert _answer(session.script(case.term, *fixed)) == expected


_RULES = [
    ("x + y <= 2 m and x > 1 m and y > 1 m", Result.UNSAT),
    ("x + y <= 2 m and x >= 1 m and y >= 1 m", Result.SAT),
    ("all(joint[j] <= 1 m for j in Joint) and joint[arm] > 1 m", Result.UNSAT),
    ("any(joint[j] > 1 m for j in Joint) and joint[arm] <= 1 m", Result.SAT),
    ("p in cell and norm(p) > 2 m", Result.UNSAT),
    ("abs(x) < max(x, -x)", Result.UNSAT),
    ("mode in {idle, stop} and mode != idle and not mode == stop", Result.UNSAT),
    ("clamp(x, 0 m, 1 m) > 1 m", Result.UNSAT),
]


@pytest.mark.parametrize(("text", "expected"), _RULES)
def test_both_solvers_agree_on_a_rule_over_all_states(text: str, expected: Result) -> None:
    ten = Fraction(10)
    scope = Scope(
        VARIABLES,
        enums={"Joint": VARIABLES["arm"].type, "Mode": VARIABLES["mode"].type},  # type: ignore[dict-item]
        volumes={"cell": Box((-Fraction(1),) * 3, (Fraction(1),) * 3)},
    )
    term = check(parse(text), scope, BOOL)
    variables = t.variables_of(term).values()
    names = [scalar.name for variable in variables for scalar in scalar_variables(variable)]
    session = z3_solver.Session(variables, dict.fromkeys(names, (-ten, ten)))
    answer = session.ask(term)
    assert answer.result is expected
    assert _answer(session.script(term)) == expected.value


def test_the_sample_of_values_reaches_both_solvers_with_every_kind_of_number() -> None:
    x = VARIABLES["x"]
    far = Fraction(10) ** 41
    for value in (Fraction(1, 3), Fraction(5e-324), Fraction(-(10**40)), Fraction(0)):
        literal = t.Literal(value, x.type)  # type: ignore[arg-type]
        session = z3_solver.Session([x], {"x": (-far, far)})
        assert _answer(session.script(t.Compare("==", x, literal))) == "sat"
        assert _answer(session.script(t.Compare("==", x, literal), t.Compare("<", x, literal))) == "unsat"

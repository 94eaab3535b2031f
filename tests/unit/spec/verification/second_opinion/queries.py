"""Questions with their answers, which the tests of second opinions share."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.backends.oracle import SolverQuery
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import LENGTH

X = t.Variable("x", RealType(LENGTH), t.VariableRole.STATE)
RANGES = {"x": (Fraction(0), Fraction(10))}


def above(bound: int) -> t.Term:
    """The condition that x is greater than `bound`."""
    return t.Compare("<", t.Literal(Fraction(bound), RealType(LENGTH)), X)


def question(bound: int, result: SatResult) -> SolverQuery:
    """The question if x can be greater than `bound`, with an answer."""
    answer = SolverAnswer(result, {"x": Fraction(7)} if result is SatResult.SAT else {})
    return SolverQuery(f"x > {bound}", Question([X], RANGES, [above(bound)]), answer)

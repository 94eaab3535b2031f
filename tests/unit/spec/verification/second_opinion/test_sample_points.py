from __future__ import annotations

from fractions import Fraction

from aeros.spec.backends.oracle import SolverQuery
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, RealType
from aeros.spec.expr.units import LENGTH
from aeros.spec.verification.second_opinion.sample_points import NEIGHBOURS, sample_points
from tests.unit.spec.verification.second_opinion.queries import question

_MODE = EnumType("Mode", ("idle", "stop"))
_STATE = t.VariableRole.STATE
_FREE = t.Variable("free", RealType(LENGTH), _STATE)
_LAPS = t.Variable("laps", IntegerType(), _STATE)
_MODES = t.Variable("mode", _MODE, _STATE)
_READY = t.Variable("ready", FamilyType(_MODE, BOOL), _STATE)


def test_points_have_both_ends_ties_with_constants_and_the_witness() -> None:
    values = [point["x"] for point in sample_points(question(3, SatResult.SAT))]
    assert values[:2] == [Fraction(0), Fraction(10)]
    assert Fraction(3) in values  # the constant that x is compared with
    assert Fraction(7) in values  # the witness
    assert all(0 <= value <= 10 for value in values if isinstance(value, Fraction))
    assert len(set(values)) >= 5


def test_without_a_witness_there_are_no_neighbours_of_it() -> None:
    possible, impossible = (sample_points(question(3, one)) for one in (SatResult.SAT, SatResult.UNSAT))
    assert len(possible) == len(impossible) + 1 + min(NEIGHBOURS, 1)


def test_the_same_question_has_the_same_points() -> None:
    assert sample_points(question(3, SatResult.SAT)) == sample_points(question(3, SatResult.SAT))


def test_each_scalar_has_values_of_its_type() -> None:
    variables = [_FREE, _LAPS, _MODES, _READY]
    asked = Question(variables, {"laps": (Fraction(1, 2), Fraction(7, 2))}, [])
    for point in sample_points(SolverQuery("it", asked, SolverAnswer(SatResult.UNSAT, {}))):
        assert set(point) == {"free", "laps", "mode", "ready[idle]", "ready[stop]"}
        assert point["laps"] in (1, 2, 3)
        assert point["mode"] in _MODE.members
        assert isinstance(point["ready[idle]"], bool)
        assert isinstance(point["free"], Fraction)

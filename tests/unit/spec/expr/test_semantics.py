from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import TimedState, evaluate
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, VectorType
from aeros.spec.expr.units import NUMBER

_REAL = RealType(NUMBER)
_SET = EnumType("Set", ("i", "j"))
A = t.Variable("a", BOOL, t.VariableRole.STATE)
F = t.Variable("f", FamilyType(_SET, _REAL), t.VariableRole.STATE)
B = t.BoundVariable("e", _SET)


def _number(value: Fraction | int) -> t.Literal:
    return t.Literal(Fraction(value), _REAL)


@pytest.mark.parametrize("a", [False, True])
def test_connectives_are_those_of_logic(a: bool) -> None:
    env = {"a": a}
    assert evaluate(t.Not(A), env) is (not a)
    assert evaluate(t.Implies(A, t.FALSE), env) is (not a)
    assert evaluate(t.Implies(t.FALSE, A), env) is True
    assert evaluate(t.And((A, t.TRUE)), env) is a
    assert evaluate(t.Or((A, t.FALSE)), env) is a


def test_an_empty_conjunction_is_true_and_an_empty_disjunction_false() -> None:
    assert evaluate(t.And(()), {}) is True
    assert evaluate(t.Or(()), {}) is False
    assert evaluate(t.conjunction(), {}) is True


def test_arithmetic_is_exact() -> None:
    third = _number(Fraction(1, 3))
    assert evaluate(t.Add(third, t.Add(third, third)), {}) == 1
    assert evaluate(t.Multiply(third, _number(3)), {}) == 1


def test_a_double_is_the_rational_it_denotes() -> None:
    x = t.Variable("x", _REAL, t.VariableRole.STATE)
    assert evaluate(t.Compare("==", x, _number(Fraction(1, 10))), {"x": Fraction(0.1)}) is False
    assert evaluate(t.Compare("==", x, _number(0)), {"x": Fraction(-0.0)}) is True


def test_the_index_chooses_by_its_place_in_the_set() -> None:
    env = {"f": (Fraction(1), Fraction(5))}
    chosen = t.Select(F, B)
    assert evaluate(chosen, {**env, "e": "j"}) == 5
    above = t.Compare("<", _number(2), chosen)
    assert evaluate(t.Quantified("any", B, above), env) is True
    assert evaluate(t.Quantified("all", B, above), env) is False
    assert evaluate(t.Aggregate("count", B, above), env) == 1
    assert evaluate(t.Aggregate("sum", B, chosen), env) == 6


def test_free_variables_come_in_order_of_occurrence() -> None:
    term = t.And((t.Compare("<", t.Select(F, B), _number(1)), A, t.Not(A)))
    assert list(t.variables_of(term)) == ["f", "a"]


def test_values_of_different_lengths_are_refused_and_not_cut_off() -> None:
    p, q = (t.Variable(name, VectorType(NUMBER), t.VariableRole.STATE) for name in "pq")
    three, two = (tuple(map(Fraction, range(length))) for length in (3, 2))
    for env in ({"p": three, "q": two}, {"p": two, "q": three}):
        with pytest.raises(ValueError, match="argument 2 is"):
            evaluate(t.Add(p, q), env)


def test_sums_and_counts_are_exact_numbers() -> None:
    env = {"f": (Fraction(1), Fraction(5))}
    for kind, body in (("sum", t.Select(F, B)), ("count", t.TRUE)):
        assert type(evaluate(t.Aggregate(kind, B, body), env)) is Fraction  # type: ignore[arg-type]


def test_a_condition_since_which_no_time_has_passed_is_within_every_window() -> None:
    for window in (None, Fraction(0), Fraction(1, 10**9)):
        assert evaluate(t.Since(t.FALSE, A, window), {"a": True}) is True
    assert evaluate(t.Occurrences(A, Fraction(0)), {"a": True}) == 1


_COUNT = t.Occurrences(A, Fraction(9))  # 2 in `_TRACE`
_BEFORE = t.Previously(A)
_TRACE = [TimedState(Fraction(at), {"a": a}) for at, a in enumerate((True, True, False))]


@pytest.mark.parametrize(
    ("term", "value"),
    [
        *[
            (t.Compare(op, left, right), held)  # type: ignore[arg-type]
            for op, held in (("<", False), ("<=", True), ("==", True))
            for left, right in ((_COUNT, _number(2)), (_number(2), _COUNT))
        ],
        (t.Add(_COUNT, _number(3)), 5),
        (t.Add(_number(3), _COUNT), 5),
        (t.Multiply(_COUNT, _number(3)), 6),
        (t.Multiply(_number(3), _COUNT), 6),
        (t.Extremum("min", _COUNT, _number(3)), 2),
        (t.Extremum("min", _number(3), _COUNT), 2),
        (t.Extremum("max", _COUNT, _number(1)), 2),
        (t.Extremum("max", _number(1), _COUNT), 2),
        (t.Absolute(t.Multiply(_number(-1), _COUNT)), 2),
        (t.Conditional(_BEFORE, _COUNT, _number(1)), 2),
        (t.Conditional(A, _number(1), _COUNT), 2),
        *[(t.Component(t.Vector(_COUNT, _COUNT, _COUNT), axis), 2) for axis in range(3)],
        (t.Aggregate("sum", B, _COUNT), 4),
        (t.Aggregate("count", B, _BEFORE), 2),
        (t.Quantified("all", B, _BEFORE), True),
        (t.Not(_BEFORE), False),
        (t.And((_BEFORE,)), True),
        (t.Or((_BEFORE,)), True),
        (t.Implies(t.Not(_BEFORE), A), True),
        (t.Implies(t.Not(A), _BEFORE), True),
        (t.Select(F, t.Conditional(_BEFORE, t.Literal("j", _SET), t.Literal("i", _SET))), 7),
    ],
)  # fmt: skip
def test_a_condition_on_the_past_has_its_value_in_every_place(term: t.Term, value: Fraction | bool) -> None:
    assert evaluate(term, {"a": False, "f": (Fraction(3), Fraction(7))}, _TRACE) == value

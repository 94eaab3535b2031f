from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import (
    _real_type,
    lower,
    scalar_variables,
    size_bounds,
    values_by_scalar,
    values_by_variable,
)
from aeros.spec.expr.semantics import Value, evaluate
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER

REAL = RealType(NUMBER)
SET = EnumType("Set", ("i", "j"))
P = t.Variable("p", VectorType(NUMBER), t.VariableRole.STATE)
F = t.Variable("f", FamilyType(SET, REAL), t.VariableRole.STATE)
C = t.Variable("c", BOOL, t.VariableRole.STATE)
E = t.BoundVariable("e", SET)
CHOSEN = t.Select(F, E)
CHOICE = t.Variable("x", REAL, t.VariableRole.STATE)
IS_I = t.Compare("==", E, t.Literal("i", SET))
MADE = t.Vector(CHOSEN, t.Literal(Fraction(2), REAL), CHOSEN)  # of the bound variable, in two places
VARIABLES = {"p": P, "f": F, "c": C}
VECTORS: dict[str, t.Term] = {
    "added on the left": t.Add(MADE, P),
    "added on the right": t.Add(P, MADE),
    "scaled": t.Multiply(t.Literal(Fraction(3), REAL), MADE),
    "scaled by": t.Multiply(CHOSEN, P),
    "chosen": t.Conditional(C, MADE, P),
    "chosen instead": t.Conditional(C, P, MADE),
    "chosen by": t.Conditional(IS_I, P, MADE),
}


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("vector", VECTORS.values(), ids=VECTORS)
def test_a_bound_variable_keeps_its_member_anywhere_in_a_vector(vector: t.Term, axis: int) -> None:
    sum_ = t.Aggregate("sum", E, t.Component(vector, axis))
    count = t.Aggregate("count", E, t.Compare("==", t.Component(vector, axis), CHOSEN))
    same = t.Quantified("any", E, t.Compare("==", vector, P))
    other = t.Quantified("all", E, t.Compare("==", P, vector))
    for c, f in itertools.product((False, True), itertools.product((Fraction(1), Fraction(2)), repeat=2)):
        for p in itertools.product((Fraction(1), Fraction(2)), repeat=3):
            env: dict[str, Value] = {"p": p, "f": f, "c": c}
            for term in (sum_, count, same, other):
                assert evaluate(lower(term), values_by_scalar(VARIABLES, env)) == evaluate(term, env)


@pytest.mark.parametrize(
    "term",
    [MADE, t.Previously(C), t.Since(C, C, None), t.Component(t.Not(C), 0)],
    ids=["vector", "before", "since", "component"],
)
def test_terms_without_a_scalar_form_are_not_lowered(term: t.Term) -> None:
    with pytest.raises(AssertionError, match=r"^not a (scalar|condition on one state|vector): "):
        lower(term)


@pytest.mark.parametrize(
    ("term", "size", "height"),
    [
        # A variable counts 3, and each node 3 and all that its expansion repeats, with the index.
        (C, 3, 1),
        (t.Not(C), 6, 2),
        (t.Select(F, t.Literal("i", SET)), 4, 2),
        (CHOSEN, 4, 2),
        (t.Select(F, t.Variable("s", SET, t.VariableRole.STATE)), 2 * (6 + 2) + 3, 2 + 1 + 1),
        (t.Quantified("all", E, C), 2 * (3 + 3) + 3, 2),
        (t.Aggregate("sum", E, CHOSEN), 2 * (3 + 4 + 4) + 3, 2 + 2 + 1),
        (t.Compare("==", P, P), 3 * (3 + 3) + 3, 2),
        (t.Compare("<=", CHOSEN, CHOSEN), 4 + 4 + 3, 3),
    ],
)
def test_the_bounds_of_sizes_by_hand(term: t.Term, size: int, height: int) -> None:
    assert size_bounds(term) == (size, height)


def test_values_are_split_into_scalars_and_put_together_again() -> None:
    place = t.Variable("place", VectorType(LENGTH), t.VariableRole.STATE)
    scalars = (*scalar_variables(place), *scalar_variables(F), *scalar_variables(C))
    assert [(one.name, one.type) for one in scalars] == [
        *((f"place.{axis}", RealType(LENGTH)) for axis in "xyz"),
        ("f[i]", REAL),
        ("f[j]", REAL),
        ("c", BOOL),
    ]
    env: dict[str, Value] = {
        "place": tuple(map(Fraction, (1, 2, 3))),
        "f": (Fraction(4), Fraction(5)),
        "c": True,
    }
    variables = {"place": place, "f": F, "c": C}
    values = values_by_scalar(variables, env)
    assert list(values) == [one.name for one in scalars]
    assert values_by_variable(variables.values(), values) == env
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        values_by_scalar({"place": place}, {"place": (Fraction(1), Fraction(2))})


def test_only_an_expression_of_reals_has_the_type_of_a_constant() -> None:
    two = t.Literal(Fraction(2), RealType(LENGTH))
    assert _real_type(t.Multiply(two, t.Absolute(two))) == RealType(LENGTH**2)
    with pytest.raises(AssertionError, match=r"^not a constant real: "):
        _real_type(C)


def test_a_sum_over_many_members_is_no_higher_than_its_bound() -> None:
    many = EnumType("Many", tuple(f"m{number}" for number in range(64)))
    each = t.BoundVariable("e", many)
    total = t.Aggregate(
        "sum", each, t.Select(t.Variable("g", FamilyType(many, REAL), t.VariableRole.STATE), each)
    )

    def height(term: t.Term) -> int:
        return 1 + max(map(height, t.children(term)), default=0)

    assert height(lower(total)) == 7 <= size_bounds(total)[1]


def test_a_table_needs_a_value_for_each_member() -> None:
    for values in ((Fraction(1),), (Fraction(1),) * 3):
        table = t.ConstantTable("limit", FamilyType(SET, REAL), values)
        with pytest.raises(ValueError, match="argument 2 is"):
            lower(t.Select(table, t.Literal("i", SET)))


def test_equal_alternatives_need_no_condition() -> None:
    assert lower(t.Conditional(C, CHOICE, CHOICE)) == CHOICE
    assert lower(t.Component(t.Conditional(C, P, P), 0)) == scalar_variables(P)[0]


def test_each_shared_part_is_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    visited: list[int] = []
    children = t.children

    def noted(term: t.Term) -> Iterator[t.Term]:
        visited.append(id(term))
        return children(term)

    monkeypatch.setattr(t, "children", noted)
    term: t.Term = CHOICE
    for _ in range(12):
        term = t.Add(term, term)
    size_bounds(term)
    assert len(visited) == len(set(visited)) == 13

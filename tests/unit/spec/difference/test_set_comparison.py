"""Differences are decided rightly: against enumeration, in both directions, with witnesses that replay."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.difference.policy_change import Relation
from aeros.spec.difference.set_comparison import ComparedSet, SetCondition, compare_sets
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from tests.hypothesis_profiles import examples

LIMIT = 1_000_000


# Against enumeration: sets of two truth values and a number, all conditions over them.

_SOURCE = Source("test", "x")
_SPAN = _SOURCE.span(0, 1)
_NUMBERS = RealType(NUMBER)
_P, _Q = (t.Variable(name, BOOL, t.VariableRole.STATE) for name in "pq")
_X = t.Variable("x", _NUMBERS, t.VariableRole.PARAMETER)


def _number(value: int) -> t.Literal:
    return t.Literal(Fraction(value, 2), _NUMBERS)


_ATOMS: st.SearchStrategy[t.Term] = st.one_of(
    st.sampled_from([_P, _Q, t.TRUE, t.FALSE]),
    st.builds(
        lambda op, n: t.Compare(op, _X, _number(2 * n)), st.sampled_from(["<", "<=", "=="]), st.integers(0, 4)
    ),
)
_TERMS: st.SearchStrategy[t.Term] = st.recursive(
    _ATOMS,
    lambda inner: st.one_of(
        st.builds(t.Not, inner),
        st.builds(lambda a, b: t.And((a, b)), inner, inner),
        st.builds(lambda a, b: t.Or((a, b)), inner, inner),
    ),
    max_leaves=6,
)
_RANGES = st.tuples(st.integers(0, 2), st.integers(2, 4)).map(
    lambda ends: (Fraction(ends[0]), Fraction(ends[1]))
)


def _side(terms: list[t.Term], bounds: tuple[Fraction, Fraction]) -> ComparedSet:
    declared = (Declared(_P, _SPAN), Declared(_Q, _SPAN), Declared(_X, _SPAN, range=bounds))
    return ComparedSet(declared, tuple(SetCondition(term, _SPAN) for term in terms), _SPAN)


def _members(side: ComparedSet) -> Iterator[tuple[bool, bool, Fraction]]:
    """Every member with `x` at a bound or between two: conditions are constant in between."""
    for p, q, half in itertools.product((False, True), (False, True), range(9)):
        x = Fraction(half, 2)
        if _has(side, {"p": p, "q": q, "x": x}):
            yield p, q, x


@examples(60)
@given(st.lists(_TERMS, max_size=2), _RANGES, st.lists(_TERMS, max_size=2), _RANGES)
def test_the_relation_of_two_sets_is_that_of_enumeration(
    one: list[t.Term],
    one_range: tuple[Fraction, Fraction],
    other: list[t.Term],
    other_range: tuple[Fraction, Fraction],
) -> None:
    before, after = _side(one, one_range), _side(other, other_range)
    found = compare_sets("test", "a test", before, after, Oracle(LIMIT))
    old, new = set(_members(before)), set(_members(after))
    assert ("newly allowed" in found.witnesses, "newly denied" in found.witnesses) == (
        bool(new - old),
        bool(old - new),
    )
    for direction, inside, outside in (("newly allowed", after, before), ("newly denied", before, after)):
        if direction in found.witnesses:
            values = {"p": False, "q": False, "x": _bounds(inside)[0], **found.witnesses[direction].values}
            assert _has(inside, values)
            assert not _has(outside, values)


def _bounds(side: ComparedSet) -> tuple[Fraction, Fraction]:
    return side.variables[2].range or (Fraction(0), Fraction(0))


def _has(side: ComparedSet, values: Mapping[str, Value]) -> bool:
    low, high = _bounds(side)
    x = values["x"]
    assert isinstance(x, Fraction)
    return low <= x <= high and all(is_true(one.term, values) for one in side.conditions)


# One by one: places, variables that differ, ranges of vectors and families.

_OLD, _NEW = (Source(name, "0123456789") for name in ("old", "new"))
_ROLES = t.VariableRole


def _one(name: str, type_: Type, role: t.VariableRole, bounds: tuple[int, int] | None = None) -> Declared:
    range_ = None if bounds is None else (Fraction(bounds[0]), Fraction(bounds[1]))
    return Declared(t.Variable(name, type_, role), _SPAN, range=range_)


def _set(
    *variables: Declared, conditions: tuple[SetCondition, ...] = (), source: Source = _OLD
) -> ComparedSet:
    return ComparedSet(variables, conditions, source.span(9, 10))


def _compared(old: ComparedSet, new: ComparedSet) -> tuple[str, list[str]]:
    found = compare_sets("x", "a `grip`", old, new, Oracle(LIMIT))
    return found.relation.value, [one.headline for one in found.diagnostics]


_FORCE = _one("force", _NUMBERS, _ROLES.PARAMETER, (0, 4))
_PAUSE = _one("inputs.pause", _NUMBERS, _ROLES.INPUT, (0, 4))
_DISTANCE = _one("distance", _NUMBERS, _ROLES.STATE, (0, 4))


def _below(one: Declared, most: int, source: Source = _OLD) -> SetCondition:
    return SetCondition(t.Compare("<=", one.variable, _number(2 * most)), source.span(most, most + 1))


def test_equal_sets_need_no_solver_and_no_diagnostic() -> None:
    side = _set(_FORCE, conditions=(_below(_FORCE, 2),))
    assert _compared(side, side) == ("equal", [])


def test_a_parameter_of_one_side_alone_cannot_be_compared() -> None:
    assert _compared(_set(_FORCE), _set()) == (
        "not comparable",
        ["cannot compare a `grip`: only the old side has `force`"],
    )
    assert _compared(_set(), _set(_FORCE))[1] == ["cannot compare a `grip`: only the new side has `force`"]


def test_an_input_of_one_side_alone_matters_where_it_is_read() -> None:
    assert _compared(_set(_FORCE), _set(_FORCE, _PAUSE)) == ("equal", [])
    read = _set(_FORCE, _PAUSE, conditions=(_below(_PAUSE, 2),))
    assert _compared(_set(_FORCE), read)[0] == "not comparable"


def test_a_state_variable_of_one_side_alone_may_have_any_value_on_the_other() -> None:
    near = _set(_FORCE, _DISTANCE, conditions=(_below(_DISTANCE, 2, _NEW),), source=_NEW)
    assert _compared(_set(_FORCE), near) == ("newly denied", ["a `grip` is newly denied"])


def test_a_type_that_changed_matters_unless_it_is_of_a_state_variable_that_nothing_reads() -> None:
    as_truth = _one("distance", BOOL, _ROLES.STATE)
    assert _compared(_set(_FORCE, _DISTANCE), _set(_FORCE, as_truth)) == ("equal", [])
    read = _set(_FORCE, _DISTANCE, conditions=(_below(_DISTANCE, 2),))
    assert _compared(read, _set(_FORCE, as_truth)) == (
        "not comparable",
        ["cannot compare a `grip`: `distance` was real [1] and is bool"],
    )
    assert _compared(_set(_FORCE), _set(_one("force", BOOL, _ROLES.PARAMETER)))[0] == "not comparable"


def test_a_set_without_members_can_be_compared_with_any() -> None:
    never = _set(_one("force", BOOL, _ROLES.PARAMETER), conditions=(SetCondition(t.FALSE, None),))
    assert _compared(never, _set(_FORCE))[0] == "newly allowed"
    assert _compared(_set(_FORCE), never)[0] == "newly denied"
    assert _compared(never, never)[0] == "equal"


def test_the_declared_ranges_are_compared_part_by_part() -> None:
    joints = EnumType("joints", ("j1", "j2"))
    for type_ in (_NUMBERS, VectorType(NUMBER), FamilyType(joints, _NUMBERS)):
        narrow, wide, other = (
            _set(_one("force", type_, _ROLES.PARAMETER, bounds)) for bounds in ((0, 4), (0, 5), (1, 5))
        )
        assert _compared(narrow, wide)[0] == "newly allowed"
        assert _compared(wide, narrow)[0] == "newly denied"
        assert _compared(narrow, other)[0] == "incomparable"
        assert _compared(other, wide)[0] == "newly allowed"


def test_the_range_of_a_state_variable_matters_where_it_is_read() -> None:
    far = _one("distance", _NUMBERS, _ROLES.STATE, (0, 9))
    assert _compared(_set(_FORCE, _DISTANCE), _set(_FORCE, far))[0] == "equal"
    sides = (_set(_FORCE, one, conditions=(_below(one, 6),)) for one in (_DISTANCE, far))
    assert _compared(*sides)[0] == "newly allowed"


def test_a_difference_is_shown_at_the_conditions_that_changed_with_the_values_they_read() -> None:
    kept = _below(_DISTANCE, 3)
    old = _set(_FORCE, _DISTANCE, conditions=(kept, _below(_FORCE, 1)))
    new = _set(_FORCE, _DISTANCE, conditions=(kept, _below(_FORCE, 2, _NEW)), source=_NEW)
    (diagnostic,) = compare_sets("x", "a `grip`", old, new, Oracle(LIMIT)).diagnostics
    assert diagnostic.primary == SpanLabel(_NEW.span(2, 3), "new")
    assert diagnostic.secondary == (SpanLabel(_OLD.span(1, 2), "old"),)
    first, second = diagnostic.notes
    assert first.startswith("for example, with\n")
    assert "force" in first
    assert "distance" not in first
    assert second == "`--format json` shows all 2 values of this witness"


def test_a_side_whose_conditions_are_all_kept_is_shown_as_a_whole() -> None:
    old, new = _set(_FORCE), _set(_FORCE, conditions=(_below(_FORCE, 2, _NEW),), source=_NEW)
    (diagnostic,) = compare_sets("x", "a `grip`", old, new, Oracle(LIMIT)).diagnostics
    assert diagnostic.secondary == (SpanLabel(_OLD.span(9, 10), "old"),)
    assert len(diagnostic.notes) == 1


def test_places_are_labelled_once_and_a_condition_without_a_place_is_left_out() -> None:
    one = _below(_FORCE, 2)
    side = _set(_FORCE)
    assert side.labels("old", (one, SetCondition(t.TRUE, None), one)) == (SpanLabel(_OLD.span(2, 3), "old"),)
    assert side.labels("old") == (SpanLabel(_OLD.span(9, 10), "old"),)
    assert ComparedSet((), (), None).labels("old") == ()


def test_a_question_beyond_the_budget_is_undecided() -> None:
    x = t.Variable("x", _NUMBERS, _ROLES.PARAMETER)
    cube = t.Multiply(x, t.Multiply(x, x))
    hard = SetCondition(t.Not(t.Compare("==", t.Add(cube, x), _number(7))), _NEW.span(0, 1))
    sides = (
        _set(_one("x", _NUMBERS, _ROLES.PARAMETER, (0, 9))),
        _set(_one("x", _NUMBERS, _ROLES.PARAMETER, (0, 9)), conditions=(hard,)),
    )
    found = compare_sets("x", "a `grip`", *sides, Oracle(1))
    assert found.relation is Relation.UNDECIDED
    assert [one.headline for one in found.diagnostics] == ["undecided: the solver could not compare a `grip`"]
    assert found.diagnostics[0].notes[0].startswith("the solver said: ")

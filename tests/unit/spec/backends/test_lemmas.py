from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends import lemmas
from aeros.spec.backends.lemmas import MAX_LEMMAS, lemmas_for, relating_lemmas
from aeros.spec.backends.length_lemmas import length_lemmas
from aeros.spec.backends.square_lemmas import square_lemmas
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, values_by_scalar
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_conditions import ConditionCase, cases, exact_environment
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import evaluate, is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType, RealType
from aeros.spec.expr.units import LENGTH, NUMBER
from tests.hypothesis_profiles import examples

_JOINT = VARIABLES["arm"].type
assert isinstance(_JOINT, EnumType)
_SCOPE = Scope(VARIABLES, enums={"Joint": _JOINT})


def terms_of(*texts: str) -> list[t.Term]:
    return [check(parse(text), _SCOPE, BOOL) for text in texts]


@examples(60)
@given(cases())
def test_every_lemma_is_true_at_every_point(case: ConditionCase) -> None:
    point = values_by_scalar(VARIABLES, exact_environment(case.values))
    terms = [case.term, t.Not(case.term)]
    nearby = {name: float(value) for name, value in point.items() if isinstance(value, bool | Fraction)}
    for lemma in (*lemmas_for(terms), *lemmas_for(terms, near=nearby)):
        assert is_true(lemma, point)


def _left(term: t.Term) -> t.Term:
    assert isinstance(term, t.Compare)
    return term.left


def _right(term: t.Term) -> t.Term:
    assert isinstance(term, t.Compare)
    return term.right


@pytest.mark.parametrize("text", ["x <= y", "2 * x + y <= 4 m", "not x < y"])
def test_a_question_without_products_counts_and_absolute_values_needs_none(text: str) -> None:
    assert lemmas_for(terms_of(text)) == []


POINTS = [{"x": Fraction(x), "y": Fraction(y)} for x in range(-4, 5) for y in range(-4, 5)]


@pytest.mark.parametrize("text", ["abs(x - y) <= y", "min(x, y) <= 1 m", "max(x, y) <= 1 m"])
def test_bounds_of_an_expression_are_true_and_one_of_them_is_an_equation_at_each_point(text: str) -> None:
    """As `abs(x)` is x or -x, and an extremum is one of the two: nothing is lost."""
    lemmas = lemmas_for(terms_of(text))
    assert len(lemmas) == 2
    assert relating_lemmas(terms_of(text)) == []
    for point in POINTS:
        assert all(is_true(one, point) for one in lemmas)
        assert any(evaluate(_left(one), point) == evaluate(_right(one), point) for one in lemmas)


@pytest.mark.parametrize("write", [lemmas_for, relating_lemmas])
def test_there_is_a_limit_to_the_number_of_lemmas(
    write: Callable[[list[t.Term]], list[t.Term]], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = terms_of("x * y <= 4 m*m")
    whole = write(asked)
    assert len(whole) == 2
    monkeypatch.setattr(lemmas, "MAX_LEMMAS", 1)
    assert write(asked) == whole[:1]


def test_there_is_an_end_to_the_lemmas() -> None:
    (one,) = terms_of("abs(x) <= 4 m")
    assert isinstance(one, t.Compare)
    sizes = [
        t.Absolute(t.Add(one.left, t.Literal(Fraction(number), RealType(LENGTH))))
        for number in range(MAX_LEMMAS)
    ]
    assert len(lemmas_for([t.Compare("<=", size, size) for size in sizes])) == MAX_LEMMAS


def test_lemmas_are_written_with_the_operators_of_the_language() -> None:
    ranges = dict.fromkeys(("x", "y", "joint[j1]"), (Fraction(-3), Fraction(2)))
    texts = (
        "abs(x) <= 4 m and min(x, y) <= 1 m and max(x, y) <= 4 m and x * y <= 8 m*m and y * abs(x) <= 8 m*m",
        "count(joint[j] <= 1 m for j in Joint) >= 2 and count(joint[j] >= 1 m for j in Joint) >= 2",
        "all(joint[j] <= 3 m for j in Joint) and all(joint[j] >= 0 m for j in Joint)",
    )
    compared = [one.op for one in t.walk(lemmas_for(terms_of(*texts), ranges)) if isinstance(one, t.Compare)]
    assert set(compared) == {"<="}
    given = {one for one in t.walk(terms_of(*texts)) if isinstance(one, t.Literal)}
    written = {one for one in t.walk(lemmas_for(terms_of(*texts), ranges)) if isinstance(one, t.Literal)}
    assert {one.type for one in written - given} == {BOOL, RealType(NUMBER)}


@pytest.mark.parametrize(
    ("texts", "count"),
    [
        (("ready[j] == (joint[j] >= 1 m)", "count(ready[j] for j in Joint) >= 2"), 3),
        (("(joint[j] >= 1 m) == ready[j]", "count(ready[j] for j in Joint) >= 2"), 3),
        (("a == (joint[j] >= 1 m)", "count(ready[j] for j in Joint) >= 2"), 0),
        (("(joint[j] >= 1 m) == a", "count(ready[j] for j in Joint) >= 2"), 0),
        (("a", "count(joint[j] == 1 m for j in Joint) >= 2"), 0),
        (("a", "(if joint[j] >= 1 m then 1 else 0) >= 1"), 3),
        (("a", "(if joint[j] >= 1 m then 1 else 2) >= 1"), 0),
        (("a", "(if joint[j] >= 1 m then 2 else 0) >= 1"), 0),
        (("a", "(if joint[j] >= 1 m then 0 else 1) >= 1"), 0),
        (("a", "(if joint[j] >= 1 m then 1 else n) >= 1"), 0),
        (("a", "(if joint[j] >= 1 m then n else 0) >= 1"), 0),
    ],
)
def test_a_count_is_of_a_comparison_that_it_names_and_of_ones_and_zeros(
    texts: tuple[str, str], count: int
) -> None:
    named, counted = (text if "count" in text else f"all({text} for j in Joint)" for text in texts)
    assert len(relating_lemmas(terms_of("all(joint[j] >= 0 m for j in Joint)", named, counted))) == count


def test_a_count_is_related_to_the_numbers_that_are_compared() -> None:
    at_least = terms_of("all(joint[j] >= 0 m for j in Joint)", "count(joint[j] >= 1 m for j in Joint) >= 2")
    assert len(relating_lemmas(at_least)) == 3  # one for each joint
    at_most = terms_of("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] <= 1 m for j in Joint) >= 2")
    assert len(relating_lemmas(at_most)) == 3
    unrelated = terms_of("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] >= 4 m for j in Joint) >= 2")
    assert relating_lemmas(unrelated) == []


def test_a_count_bounds_what_is_compared_from_the_other_side_too() -> None:
    most = terms_of("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] > 1 m for j in Joint) <= 2")
    assert len(relating_lemmas(most)) == 3
    least = terms_of("count(joint[j] < 1 m for j in Joint) <= 2")
    ranges = dict.fromkeys(("joint[j1]", "joint[j2]", "joint[j3]"), (Fraction(-2), Fraction(0)))
    assert len(relating_lemmas(least, ranges)) == 3
    assert relating_lemmas(least) == []


def test_a_product_is_related_to_the_absolute_value_of_a_factor() -> None:
    by_condition = relating_lemmas(terms_of("abs(x) <= 4 m", "abs(y) <= 2 m", "x * y <= 8 m*m"))
    by_range = relating_lemmas(
        terms_of("x * y <= 8 m*m", "abs(x) <= 7 m * 7"), {"y": (Fraction(-3), Fraction(2))}
    )
    bounds = [one for one in (*by_condition, *by_range) if isinstance(one, t.Implies)]
    assert len(bounds) == 3 + 3  # of each factor, and of `y` by its range; and their squares
    point = {"x": Fraction(4), "y": Fraction(2)}
    assert all(is_true(one, point) for one in bounds)


@examples(60)
@given(cases(), st.tuples(st.fractions(-5, 5), st.fractions(0, 5)))
def test_a_lemma_with_a_range_is_true_in_and_out_of_it(
    case: ConditionCase, range_: tuple[Fraction, Fraction]
) -> None:
    point = values_by_scalar(VARIABLES, exact_environment(case.values))
    low, width = range_
    for lemma in lemmas_for([case.term, t.Not(case.term)], dict.fromkeys(point, (low, low + width))):
        assert is_true(lemma, point)


@pytest.mark.parametrize(
    ("required", "counted", "tight"),
    [
        ("joint[j] >= 0 m", "joint[j] >= 2 m", {0, 2}),
        ("joint[j] >= -1 m", "joint[j] <= 2 m", {-1}),  # and near to 2 from above
        ("joint[j] <= 3 m", "joint[j] <= 1 m", {1, 3}),
        ("joint[j] <= 3 m", "joint[j] >= 1 m", {3}),
        ("joint[j] <= 1 m", "joint[j] <= 1 m", {1}),
        ("joint[j] >= 1 m", "joint[j] >= 1 m", {1}),
        ("joint[j] >= 0 m", "joint[j] <= 0 m", {0}),
        ("joint[j] <= 0 m", "joint[j] >= 0 m", {0}),
    ],
)
def test_a_lemma_of_a_count_is_true_everywhere_and_as_sharp_as_can_be(
    required: str, counted: str, tight: set[int]
) -> None:
    texts = f"all({required} for j in Joint)", f"count({counted} for j in Joint) >= 2"
    halves = [Fraction(half, 2) for half in range(-12, 13)]  # from -6 to 6
    lemmas = relating_lemmas(terms_of(*texts))
    assert len(lemmas) == 3
    for lemma in lemmas:
        points = {half: {f"joint[j{number}]": half for number in (1, 2, 3)} for half in halves}
        assert all(is_true(lemma, point) for point in points.values())
        assert isinstance(lemma, t.Implies)
        assert isinstance(lemma.conclusion, t.Compare)
        sharper = t.Implies(lemma.premise, t.Compare("<", lemma.conclusion.left, lemma.conclusion.right))
        assert {half for half, point in points.items() if not is_true(sharper, point)} == tight


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("x", "x", True),
        ("x", "y", False),
        ("x + y", "y + x", True),
        ("x - y", "x + y", False),
        ("x + 1 m - x + y", "y + 1 m", True),
        ("2 * (x + 1 m)", "x + x + 2 m", True),
        ("2 * (x + 1 m)", "x + 2 m", False),
        ("(x + 1 m) * 3", "3 * x + 3 m", True),
        ("3 * (2 * x + 4 m)", "6 * x + 12 m", True),
        ("2 * (3 * x)", "1.5 * x", False),
        ("x * 3", "x * 2", False),
        ("0 * x + y", "y", True),
        ("x + 0 m", "x", True),
        ("x + 1 m", "x + 2 m", False),
    ],
)
def test_factors_that_are_the_same_linear_form_are_one_factor(one: str, other: str, *, same: bool) -> None:
    lemmas = relating_lemmas(terms_of(f"({one}) * ({other}) >= 0 m*m"))
    assert (lemmas == []) is same
    assert all(is_true(lemma, point) for lemma in lemmas for point in POINTS)


@pytest.mark.parametrize(
    "text",
    [
        "abs(x) * y <= 4 m*m",
        "y * (x + abs(x)) <= 4 m*m",
        "y * (abs(x) + x) <= 4 m*m",
        "y * (2 * abs(x)) <= 4 m*m",
        "2 * y <= 4 m",
        "y * 0 <= 4 m",
        "(x - x) * y <= 4 m*m",
        "(0 * x) * y <= 4 m*m",
        "y * (x * 0) <= 4 m*m",
    ],
)
def test_factors_that_are_constant_or_not_linear_have_no_squares(text: str) -> None:
    assert relating_lemmas(terms_of(text)) == []


@pytest.mark.parametrize("product", ["x * y", "y * x"])
@pytest.mark.parametrize(
    ("bound", "limit"),
    [
        ("abs(y) <= 2 m", 2),
        ("y <= 2 m and -3 m <= y", 3),
        ("y < 1 m and -1 m < y", 1),
        ("y <= -1 m and y >= -2 m", 2),
    ],
)
def test_a_product_is_within_its_factor_times_the_bound_of_the_other_and_no_less(
    bound: str, limit: int, product: str
) -> None:
    (lemma,) = relating_lemmas(terms_of(bound, "abs(x) * 7 <= 49 m", f"{product} <= 0 m*m"))[:1]
    assert isinstance(lemma, t.Implies)
    (premise,) = terms_of(bound)
    for point in POINTS:
        assert is_true(lemma.premise, point) is is_true(premise, point)
        within = not point["x"] or abs(point["y"]) <= limit
        assert is_true(lemma.conclusion, point) is within


@pytest.mark.parametrize("bound", ["abs(y) {} 2 m", "2 m {} abs(y)", "y {} 2 m and -3 m {} y"])
@pytest.mark.parametrize("op", ["<", "<=", ">=", ">", "=="])
def test_a_lemma_of_a_product_is_true_for_any_premise(bound: str, op: str) -> None:
    texts = bound.replace("{}", op), "abs(x) <= 4 m", "abs(x) * 7 <= 49 m", "x * y <= 8 m*m", "y * x <= 9 m*m"
    for lemma in relating_lemmas(terms_of(*texts)):
        if isinstance(lemma, t.Implies):
            assert all(is_true(lemma, point) for point in POINTS)


@pytest.mark.parametrize("write", [lemmas_for, relating_lemmas])
def test_lengths_and_the_nearest_point_have_lemmas_of_their_own(write: Callable[..., list[t.Term]]) -> None:
    terms = terms_of("norm(p) <= 2 m", "norm(q) <= 3 m", "dot(p, q) >= 6 m*m")
    parts = [one for term in terms for one in t.walk([lower(term)])]
    near = {f"{point}.{axis}": float(size) for point, size in (("p", 2), ("q", 3)) for axis in "xyz"}
    assert {*length_lemmas(parts), *square_lemmas(parts, {})} <= {*write(terms)}
    assert {*write(terms, {}, near)} - {*write(terms)} == {*square_lemmas(parts, near)} - {*write(terms)}
    assert len({*write(terms, {}, near)}) > len({*write(terms)})


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("abs(x) + abs(y) <= 4 m", 2 + 2),  # x * y beside each size, and the square of each
        ("abs(x) + abs(y) >= 4 m", 0),
        ("abs(x) + y <= 4 m", 0),
        ("abs(x) + abs(y) + abs(p.x) <= 4 m", 2 + 3),
        ("abs(x) + abs(y) + p.x <= 4 m", 0),
    ],
)
def test_a_bound_of_a_sum_of_sizes_bounds_each_of_them(text: str, count: int) -> None:
    found = [one for one in relating_lemmas(terms_of(text, "x * y <= 8 m*m")) if isinstance(one, t.Implies)]
    of_sums = {*length_lemmas(list(t.walk(map(lower, terms_of(text)))))}
    of_each = [one for one in found if one not in of_sums]
    assert len(of_each) == count
    for x in range(-6, 7):
        for y in range(-6, 7):
            point = {"x": Fraction(x), "y": Fraction(y), "p.x": Fraction(x - y)}
            assert all(is_true(one, point) for one in of_each)
    tight = {"x": Fraction(4), "y": Fraction(4), "p.x": Fraction(4)}
    conclusions = [
        one for lemma in of_each for one in t.walk([lemma.conclusion]) if isinstance(one, t.Compare)
    ]
    assert all(is_true(one, tight) for one in conclusions)
    assert sum(evaluate(one.left, tight) == evaluate(one.right, tight) for one in conclusions) == count

"""Bounds alone decide as Z3 does, for random questions and for those of real sites."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends import interval_solver as boxes_module
from aeros.spec.backends.interval import search
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.backends.interval_solver import IntervalSolver
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from aeros.spec.backends.z3_solver import IncrementalSolver
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_conditions import Ranges, conditions, vocabulary_ranges
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import AxisAlignedBox, Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.verify import verify
from tests.differential.gate.box_questions import Asked, questions
from tests.hypothesis_profiles import examples

REPOSITORY = Path(__file__).parents[3]
TEN = Fraction(10)
_SETTINGS = examples(75)


def _agrees(
    variables: Sequence[t.Variable], ranges: Mapping[str, tuple[Fraction, Fraction]], terms: Sequence[t.Term]
) -> SolverAnswer | None:
    """Decide a question by bounds, after comparing the result with Z3 and with the definition."""
    found = IntervalSolver().decide(variables, ranges, terms)
    if found is None:
        return None
    if found.result is SatResult.SAT:
        assert all(is_true(lower(term), found.model) for term in terms)
        for name, (low, high) in ranges.items():
            value = found.model.get(name, low)
            assert not isinstance(value, Fraction) or low <= value <= high
    else:
        assert found.model == {}
        assert IncrementalSolver(variables, ranges).check_sat(*terms).result is SatResult.UNSAT
    return found


@_SETTINGS
@given(st.lists(conditions(), min_size=1, max_size=4), vocabulary_ranges())
def test_bounds_never_contradict_the_solver(terms: list[t.Term], ranges: Ranges) -> None:
    _agrees(list(VARIABLES.values()), ranges, terms)


@examples(60)
@given(questions())
def test_bounds_never_contradict_the_solver_nor_a_grid_where_they_are_busy(asked: Asked) -> None:
    found = _agrees(asked.variables, asked.ranges, asked.terms)
    if found is not None and found.result is SatResult.UNSAT:
        every = t.And(asked.terms)
        assert not any(is_true(lower(every), point) for point in asked.points(24))


@examples(30)
@given(st.lists(questions(), min_size=2, max_size=4))
def test_an_answer_does_not_depend_on_what_was_asked_before(several: list[Asked]) -> None:
    remembers = IntervalSolver()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(boxes_module, "MAX_CACHED", 6)
        for asked, other in itertools.product(several, repeat=2):
            question = (asked.variables, other.ranges, asked.terms)
            assert remembers.decide(*question) == IntervalSolver().decide(*question)


def test_an_answer_remembered_for_a_real_is_not_used_for_a_whole_number() -> None:
    remembers = IntervalSolver()
    for type_, expected in ((RealType(NUMBER), SatResult.SAT), (IntegerType(), None)) * 2:
        n = t.Variable("n", type_, t.VariableRole.STATE)
        zero, one = (t.Literal(Fraction(end), RealType(NUMBER)) for end in (0, 1))
        found = remembers.decide([n], {}, [t.Compare("<", zero, n), t.Compare("<", n, one)])
        assert (None if found is None else found.result) is expected


_ASKED = [
    ("x > 1 m and x < 1 m", SatResult.UNSAT),
    ("x >= 1 m and x <= 1 m", SatResult.SAT),
    ("x >= 1 m and x < 1 m", SatResult.UNSAT),
    ("x == 1 m and x != 1 m", SatResult.UNSAT),
    ("x > 10 m", SatResult.UNSAT),
    ("x >= 10 m", SatResult.SAT),
    ("-2 * x < -18 m and x <= 9 m", SatResult.UNSAT),
    ("abs(x) <= 1 m and x >= -1 m and x <= -1 m", SatResult.SAT),
    ("abs(x) > 1 m and x >= -1 m and x <= 1 m", SatResult.UNSAT),
    ("abs(x) < 1 m and x >= 1 m", SatResult.UNSAT),
    ("abs(x) < 1 m and x <= -1 m", SatResult.UNSAT),
    ("not abs(x) < 1 m and x > -1 m and x <= 1 m", SatResult.SAT),
    ("2 m < abs(x) and x < 0 m", SatResult.SAT),
    ("2 m < abs(x) and x >= -2 m and x <= 2 m", SatResult.UNSAT),
    ("not 2 m < abs(x) and x < -2 m", SatResult.UNSAT),
    ("not abs(x) < 1 m and x > -1 m and x < 1 m", SatResult.UNSAT),
    ("x <= 1 m and x >= 1 m and x > 1 m", SatResult.UNSAT),
    ("x >= 1 m and x <= 1 m and x < 1 m", SatResult.UNSAT),
    ("x + y > 2 m and x <= 1 m and y <= 1 m", SatResult.UNSAT),
    ("x + y <= 2 m and x >= 1 m and y > 1 m", SatResult.UNSAT),
    ("max(x, y) < 1 m and x >= 1 m", SatResult.UNSAT),
    ("x + y <= 2 m and x > 1 m and y > 1 m", SatResult.UNSAT),
    ("x + y <= 2 m and x >= 1 m and y >= 1 m", SatResult.SAT),
    ("x - y < 0 m and y - x <= 0 m", SatResult.UNSAT),
    ("x - y <= 0 m and y - x <= 0 m and x > 9 m", SatResult.SAT),
    ("(x > 1 m or y > 1 m) and x <= 1 m and y <= 1 m", SatResult.UNSAT),
    ("(x > 1 m or y > 1 m) and x <= 1 m", SatResult.SAT),
    ("x > 1 m implies y > 1 m", SatResult.SAT),
    ("x < x", SatResult.UNSAT),
    ("x - y <= x - y", SatResult.SAT),
    ("not 1 m < abs(x) and x > 1 m", SatResult.UNSAT),
    ("not 1 m < abs(x) and x < -1 m", SatResult.UNSAT),
    # What is tried first is refuted, and none of it may be left when the next is tried.
    ("(x >= 1 m and y >= 1 m or x <= 0 m and y <= 0 m) and x + y <= 1 m", SatResult.SAT),
    ("(x >= 2 m and y >= 0 m and abs(x) + y <= 1 m) or (x >= 5 m and y >= 5 m)", SatResult.SAT),
    ("(x >= 2 m and y >= 0 m and x + y <= 1 m and (y <= -9 m or y <= -8 m)) or y >= 5 m", SatResult.SAT),
    ("max(x, y) <= 1 m and x >= 1 m and x <= 1 m", SatResult.SAT),
    ("mode in {idle, stop} and mode != idle and not mode == stop", SatResult.UNSAT),
    ("mode in {idle, stop} and mode != idle", SatResult.SAT),
    ("p in cell and norm(p) > 2 m", SatResult.UNSAT),
    ("p in cell and p.x > 1 m", SatResult.UNSAT),
    ("all(joint[j] <= 1 m for j in Joint) and any(joint[j] > 1 m for j in Joint)", SatResult.UNSAT),
    ("x + y + p.x == 25 m", SatResult.SAT),  # not in the middle of what each of them may be
    ("x - x < 0 m", SatResult.UNSAT),
    ("x - x <= 0 m and not x < x", SatResult.SAT),
    ("max(x, y) == 11 m", SatResult.UNSAT),
    ("max(x, y) <= -11 m", SatResult.UNSAT),
    ("all(not joint[j] <= 1 m for j in Joint) and joint[j1] <= 1 m", SatResult.UNSAT),
    ("abs(x) + abs(y) < 0 m", SatResult.UNSAT),
    ("abs(x) + abs(y) < 9 m and x <= -9 m", SatResult.UNSAT),
    ("abs(x) + abs(y) > 2 m and abs(x) <= 1 m and abs(y) <= 1 m", SatResult.UNSAT),
    ("abs(x) * 1 m <= x * x and x > 9 m", SatResult.SAT),
    ("max(x, y) < 1 m and min(x, y) > 9 m and x >= 9 m", SatResult.UNSAT),
    ("max(x, 3 m) <= y and y < 3 m", SatResult.UNSAT),
    ("max(x, 3 m) <= y and y <= 3 m", SatResult.SAT),
    ("max(x, 3 m) < y and y <= 3 m", SatResult.UNSAT),
    ("not max(x, 3 m) <= y and y >= 4 m and x <= 4 m", SatResult.UNSAT),
    ("not max(x, 3 m) < y and y >= 4 m and x <= 4 m", SatResult.SAT),
    ("y <= min(x, 3 m) and y > 3 m", SatResult.UNSAT),
    ("y <= min(x, 3 m) and y >= 3 m", SatResult.SAT),
    ("y < min(x, 3 m) and y >= 3 m", SatResult.UNSAT),
    ("not y <= min(x, 3 m) and y <= -9 m and x >= -9 m", SatResult.UNSAT),
    ("not y < min(x, 3 m) and y <= -9 m and x >= -9 m", SatResult.SAT),
    ("x * x + y * y > 199 * (1 m * 1 m)", SatResult.SAT),
    ("x * y < -80 * (1 m * 1 m) and x < 10 m and y > -10 m", SatResult.SAT),
    ("p.x - x / 4 < 1 m and x - y <= 0 m and y <= 1 m and p.x >= 0 m", SatResult.SAT),
    ("p.x - x > 1 m and x - y >= 0 m and y >= 9.5 m", SatResult.UNSAT),
    # what is settled, or leaves one alternative, takes no box of its own: here are more than there may be
    (" and ".join(["x >= 5 m", *(f"(x >= {n} cm or y > {n} cm)" for n in range(30))]), SatResult.SAT),
    (" and ".join(["x >= 5 m", *(f"(x <= {n} cm or y > {n} cm)" for n in range(30))]), SatResult.SAT),
    ("x >= 5 m and (x <= 1 m or a) and (x < 1 m or not a)", SatResult.UNSAT),
]


@pytest.mark.parametrize(("text", "expected"), _ASKED)
def test_questions_that_bounds_decide(text: str, expected: SatResult) -> None:
    scope = Scope(
        VARIABLES,
        enums={"Joint": VARIABLES["arm"].type, "Mode": VARIABLES["mode"].type},  # type: ignore[dict-item]
        volumes={"cell": AxisAlignedBox((-Fraction(1),) * 3, (Fraction(1),) * 3)},
    )
    term = check(parse(text), scope, BOOL)
    variables = list(t.variables_of(term).values())
    names = [scalar.name for variable in variables for scalar in scalar_variables(variable)]
    ranges = dict.fromkeys(names, (-TEN, TEN))
    found = _agrees(variables, ranges, [term])
    assert found is not None
    assert found.result is expected
    assert IncrementalSolver(variables, ranges).check_sat(term).result is expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("max(x, y) <= 1 m", SatResult.SAT),
        ("max(x, y) <= 1 m and min(x, y) >= 1 m", None),
        ("max(x, y) <= 1 m and x > 1 m and x < 1 m", SatResult.UNSAT),
    ],
)
def test_a_variable_without_a_range_may_be_anything(text: str, expected: SatResult | None) -> None:
    term = check(parse(text), Scope(VARIABLES), BOOL)
    found = _agrees(list(t.variables_of(term).values()), {}, [term])
    assert (None if found is None else found.result) is expected


@pytest.mark.parametrize(
    "text",
    [
        "x * y == 2 m",
        "x * x == 2 m",
        "x * x == 2 m or (a and not a)",  # that one alternative is refuted says nothing of the other
        "(a and not a) or x * x == 2 m",
    ],
)
def test_questions_that_bounds_do_not_decide_go_to_the_solver(text: str) -> None:
    term = check(parse(text.replace("2 m", "2 m * 1 m")), Scope(VARIABLES), BOOL)
    variables = list(t.variables_of(term).values())
    assert IntervalSolver().decide(variables, dict.fromkeys(("x", "y"), (-TEN, TEN)), [term]) is None


@pytest.mark.parametrize(
    ("low", "high", "expected"), [(1, 4, SatResult.SAT), (1, 2, None), (5, 2, SatResult.UNSAT)]
)
def test_a_whole_number_is_found_or_left_to_the_solver(
    low: int, high: int, expected: SatResult | None
) -> None:
    count = t.Variable("n", IntegerType(), t.VariableRole.STATE)
    third = [t.Literal(Fraction(one, 3), IntegerType()) for one in (low, high)]
    found = _agrees([count], {}, [t.Compare("<=", third[0], count), t.Compare("<=", count, third[1])])
    assert (None if found is None else found.result) is expected


def test_a_question_of_too_many_boxes_is_left_to_the_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    x, y = VARIABLES["x"], VARIABLES["y"]
    either = check(parse("x > 1 m or y > 1 m"), Scope(VARIABLES), BOOL)
    ranges = {"x": (-TEN, TEN), "y": (-TEN, TEN)}
    assert IntervalSolver().decide([x, y], ranges, [either]) is not None
    monkeypatch.setattr(search, "MAX_BOXES", 2)
    assert IntervalSolver().decide([x, y], ranges, [either]) is not None
    monkeypatch.setattr(search, "MAX_BOXES", 1)
    assert IntervalSolver().decide([x, y], ranges, [either]) is None


def test_every_answer_about_the_reference_modules_is_the_solvers(monkeypatch: pytest.MonkeyPatch) -> None:
    honest, results = IntervalSolver.decide, dict[object, SatResult]()

    def compared(
        self: IntervalSolver,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
    ) -> SolverAnswer | None:
        found = honest(self, variables, ranges, terms)
        asked = (tuple(variables), tuple(ranges.items()), tuple(terms))
        if found is not None and asked not in results:
            assert IncrementalSolver(variables, ranges).check_sat(*terms).result is found.result
            results[asked] = found.result
        return found

    monkeypatch.setattr(IntervalSolver, "decide", compared)
    verify([REPOSITORY / "ecms"], reference_site_path())
    assert min(list(results.values()).count(one) for one in (SatResult.SAT, SatResult.UNSAT)) > 10


def test_the_comparison_refuses_a_broken_twin(monkeypatch: pytest.MonkeyPatch) -> None:
    def closed(self: Interval) -> bool:
        return self.low is not None and self.high is not None and self.low >= self.high

    monkeypatch.setattr(Interval, "is_empty", property(closed))
    with pytest.raises(AssertionError):
        test_questions_that_bounds_decide("x >= 1 m and x <= 1 m", SatResult.SAT)

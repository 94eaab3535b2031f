"""Past-time operators: their meaning along a trace, and expressions that are refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.semantics import TimedState, evaluate
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import TIME
from tests.unit.spec.expr.scope import SCOPE

PAST = replace(SCOPE, past=True)


def condition(text: str) -> t.Term:
    return check(parse(text), PAST, BOOL)


def along(text: str, **series: str) -> str:
    """Evaluate `text` in each state, one a second: `#` where it holds and `.` where not."""
    term, length = condition(text), len(next(iter(series.values())))
    snapshots: Sequence[TimedState] = [
        TimedState(Fraction(second), {name: marks[second] == "#" for name, marks in series.items()})
        for second in range(length)
    ]
    held = [evaluate(term, snapshots[end].values, snapshots[: end + 1]) for end in range(length)]
    return "".join("#" if one else "." for one in held)


@pytest.mark.parametrize(
    ("text", "a", "held"),
    [
        ("previously a", "#..##.", ".#..##"),
        ("previously previously a", "#..##.", "..#..#"),
        ("not previously not a", "#..##.", "##..##"),
        ("once a", "..#...", "..####"),
        ("once within 2 s a", ".#....#.", ".###..##"),
        ("historically a", "##.###", "##...."),
        ("historically within 2 s a", "##.#####", "##...###"),
        ("once within 1 s not a", "##.#####", "..##...."),
        ("count within 2 s (a) >= 2", "#.#.##..", "..#.###."),
        ("count within 3 s (a and not previously a) >= 2", "##.#..#.", "...#..#."),
        ("a implies once within 1 s not a", "##.##", "..##."),
    ],
)
def test_operators_of_one_condition(text: str, a: str, held: str) -> None:
    assert along(text, a=a) == held


@pytest.mark.parametrize(
    ("text", "a", "b", "held"),
    [
        ("a since b", "######", "..#...", "..####"),
        ("a since b", "...##.", "..#...", "..###."),
        ("a since b", "....##", "..#...", "..#..."),
        ("a since within 1 s b", "######", "..#...", "..##.."),
        ("not a since b", "..#.#.", "#.....", "##...."),
    ],
)
def test_since_requires_its_condition_in_every_later_state(text: str, a: str, b: str, held: str) -> None:
    assert along(text, a=a, b=b) == held


def test_a_quantifier_index_keeps_its_member_in_past_states() -> None:
    term = condition("all(once ready[j] for j in Joint)")
    seen = [(True, False, False), (False, True, False), (False, False, True)]
    snapshots = [TimedState(Fraction(second), {"ready": one}) for second, one in enumerate(seen)]
    assert [evaluate(term, snapshots[end].values, snapshots[: end + 1]) for end in range(3)] == [
        False,
        False,
        True,
    ]


@pytest.mark.parametrize(
    "place",
    [
        "not {}", "{} and a", "a or {}", "{} implies a", "a implies {}", "{} == a", "a == {}",
        "{real} <= 1", "1 < {real}", "{real} == 1", "2 == {real}", "{real} + 1 == 2", "1 + {real} == 3",
        "{real} * 3 == 3", "3 * {real} == 6", "min({real}, 3) == 1", "min(3, {real}) == 2",
        "max({real}, 0) == 1", "max(0, {real}) == 2", "abs({real}) == 1",
        "vec({real}, 0, 0) == vec(1, 0, 0)", "vec(0, {real}, 0).y == 1", "vec(0, 0, {real}).z == 2",
        "vec({real}, 0, 0) + vec(0, {real}, 0) == vec(1, 1, 0)", "{real} * vec(1, 1, 1) == vec(2, 2, 2)",
        "if {} then a else not a", "if a then {} else a", "if a then a else {}",
        "all({} or j == j1 for j in Joint)", "any({} and j == j1 for j in Joint)",
        "sum({real} for j in Joint) == 3", "count({} for j in Joint) == 3",
        "limit[if {} then j1 else j2] == 1 m",
        "previously {}", "once {}", "{} since a", "a since {}", "count within 2 s ({}) == 1",
    ],
)  # fmt: skip
def test_a_past_time_operator_means_the_same_at_every_place_of_an_expression(place: str) -> None:
    def written(condition: str) -> str:
        return place.format(condition, real=f"(if {condition} then 1 else 2)")

    a = "#.##...#"
    assert along(written("(previously a)"), a=a) == along(written("b"), a=a, b=along("previously a", a=a))


def test_without_a_trace_the_present_state_is_the_first() -> None:
    env = {"a": True, "b": False}
    assert evaluate(condition("once a and not once b and not previously a"), env) is True
    assert evaluate(condition("count within 5 s (a) == 1 and historically a"), env) is True


@pytest.mark.parametrize(
    ("text", "code", "message", "underlined"),
    [
        ("once speed > 0 m/s", "AE209", "`once` reads past measurements, but `speed`", "speed > 0 m/s"),
        ("a since inputs.grip == open", "AE209", "`inputs.grip` is not measured", "inputs.grip == open"),
        ("once within 0 s a", "AE209", "a window must be a constant time above 0 s", "0 s"),
        ("once within b a", "AE203", "a window must be a real number, not bool", "b"),
        ("once within k a", "AE204", "a window must be a time, not real [1]", "k"),
        ("once within 5 m a", "AE204", "a window must be a time, not real [m]", "5 m"),
        ("historically x", "AE203", "expected a condition, found real [m]", "x"),
        ("count within 5 s (x) <= 1", "AE203", "expected a condition, found real [m]", "x"),
        ("count within 5 s (a)", "AE203", "expected bool, found real [1]", "count within 5 s (a)"),
    ],
)
def test_an_error_states_problem_and_place(text: str, code: str, message: str, underlined: str) -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        condition(text)
    fault = raised.value
    assert fault.code == code
    assert message in fault.message
    assert text[fault.extent.start : fault.extent.end] == underlined


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        ("once speed > 0 m/s", "use state variables of the vocabulary only"),
        ("once within 0 s a", "as in `within 5 s`"),
    ],
)
def test_an_error_suggests_a_replacement(text: str, cure: str) -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        condition(text)
    assert raised.value.cure == cure


@pytest.mark.parametrize(
    "text", ["once within a", "count within (a)", "a since", "once within -1 s a", "previously"]
)
def test_an_incomplete_past_time_operator_is_a_syntax_error(text: str) -> None:
    with pytest.raises(ExpressionSyntaxError):
        parse(text)


def test_a_window_may_be_a_constant_of_the_site() -> None:
    scope = replace(PAST, constants={"memory": t.Literal(Fraction(2), RealType(TIME))})
    assert check(parse("once within memory a"), scope, BOOL) == condition("once within 2 s a")

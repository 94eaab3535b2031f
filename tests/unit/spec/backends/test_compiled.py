from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import product
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends import compiled
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, values_by_scalar
from aeros.spec.expr.random_conditions import (
    Raw,
    environments,
    exact_environment,
    reals,
    to_scalars,
    vocabulary_ranges,
)
from aeros.spec.expr.random_terms import MODE, VARIABLES
from aeros.spec.expr.semantics import evaluate, is_true
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from tests.hypothesis_profiles import examples

_NUMBER = RealType(NUMBER)
X, Y, Z = (t.Variable(name, _NUMBER, t.VariableRole.STATE) for name in "xyz")
_ZERO = Fraction(0)


def _constant(value: Fraction | int | str) -> t.Literal:
    return t.Literal(Fraction(value), _NUMBER)


def _unit_ranges(size: Fraction = Fraction(1)) -> dict[str, tuple[Fraction, Fraction]]:
    return dict.fromkeys("xyz", (-size, size))


@st.composite
def _bounded(
    draw: st.DrawFn,
) -> tuple[t.Term, compiled._RealCode, compiled._CodeGenerator, Mapping[str, Raw]]:
    term = draw(reals())
    ranges = draw(vocabulary_ranges())
    values = draw(environments(term, ranges))
    generator = compiled._CodeGenerator(ranges)
    return term, generator._real(lower(term)), generator, values


@examples(60)
@given(_bounded())
def test_the_error_bound_is_a_bound(
    drawn: tuple[t.Term, compiled._RealCode, compiled._CodeGenerator, Mapping[str, Raw]],
) -> None:
    term, real, generator, values = drawn
    if real.peak > compiled._LARGEST:
        return
    computed = Fraction(cast("float", generator.function("v", real.code)(to_scalars(values))))
    exact = cast("Fraction", evaluate(term, exact_environment(values)))
    assert abs(computed - exact) <= real.error
    assert abs(computed) <= real.magnitude <= real.peak
    assert exact == evaluate(lower(term), values_by_scalar(VARIABLES, exact_environment(values)))


@pytest.mark.parametrize(
    "constant",
    [
        Fraction(1, 10),
        Fraction(1, 3),
        Fraction(-1, 3),
        Fraction(1),
        _ZERO,
        Fraction(1, 2**1074),
        Fraction(1, 2**1075),
        Fraction(-1, 10**400),
        Fraction(2**53 + 1),
        Fraction(10) ** 400,
        -(Fraction(10) ** 400),
        Fraction(math.nextafter(math.inf, 0.0)),
        Fraction(math.nextafter(math.inf, 0.0)) + 1,
    ],
)
@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("op", ["<", "<=", "=="])
def test_comparing_a_variable_to_a_constant_is_exact_at_and_next_to_the_constant(
    constant: Fraction, op: str, flipped: bool
) -> None:
    sides = (_constant(constant), X) if flipped else (X, _constant(constant))
    term = t.Compare(op, *sides)  # type: ignore[arg-type]
    decide = compiled.compile_condition(term, _unit_ranges(Fraction(10) ** 309))
    largest = math.nextafter(math.inf, 0.0)
    middle = float(max(min(constant, Fraction(largest)), Fraction(-largest)))
    near = [middle, math.nextafter(middle, math.inf), math.nextafter(middle, -math.inf)]
    for value in [*near, 0.0, -0.0, 5e-324, -5e-324, 1.0, largest, -largest]:
        if math.isfinite(value):
            assert decide({"x": value}) is is_true(term, {"x": Fraction(value)}), value


def test_three_times_the_double_next_to_a_tenth_is_not_three_tenths() -> None:
    term = t.Compare("==", t.Add(t.Add(X, X), X), _constant("3/10"))
    decide = compiled.compile_condition(term, _unit_ranges())
    assert decide({"x": 0.1}) is False
    assert Fraction(0.1) * 3 != Fraction(3, 10)


@pytest.mark.parametrize("op", ["<", "<=", "=="])
def test_an_intermediate_overflow_is_decided_exactly(op: str) -> None:
    product = t.Multiply(t.Multiply(X, Y), _constant(Fraction(1, 10**300)))
    term = t.Compare(op, product, _constant(Fraction(10) ** 100))  # type: ignore[arg-type]
    decide = compiled.compile_condition(term, _unit_ranges(Fraction(10) ** 200))
    for value in (1e200, -1e200, 9e199):
        env = {"x": value, "y": 1e200}
        assert decide(env) is is_true(term, {name: Fraction(one) for name, one in env.items()})


_HUGE = t.Multiply(t.Multiply(X, Y), _constant(Fraction(1, 10**300)))


@pytest.mark.parametrize(
    "around",
    [
        t.Add(_HUGE, Z), t.Add(Z, _HUGE), t.Multiply(_HUGE, _constant(1)), t.Multiply(_constant(1), _HUGE),
        t.Extremum("min", _HUGE, Z), t.Extremum("max", Z, _HUGE), t.Absolute(_HUGE),
        t.Conditional(t.Compare("<", Z, X), _HUGE, Z), t.Conditional(t.Compare("<", X, Z), Z, _HUGE),
    ],
)  # fmt: skip
def test_an_overflow_deep_in_a_term_is_decided_exactly(around: t.Term) -> None:
    ranges = _unit_ranges(Fraction(10) ** 200)
    values = {"x": 1e200, "y": 1e200, "z": -1.0}
    exact = {name: Fraction(one) for name, one in values.items()}
    at_it = _constant(cast("Fraction", evaluate(around, exact)))
    for op, held in (("<", False), ("<=", True), ("==", True)):
        term = t.Compare(op, around, at_it)  # type: ignore[arg-type]
        assert compiled.compile_condition(term, ranges)(values) is held


def test_an_unbounded_constant_in_a_product_is_decided_exactly() -> None:
    term = t.Compare("<=", t.Multiply(_constant(Fraction(10) ** 400), X), Y)
    decide = compiled.compile_condition(term, _unit_ranges(Fraction(1, 10**300)))
    for x, y in ((1e-310, 1e-300), (-1e-310, 0.0), (0.0, 0.0), (0.0, -5e-324)):
        assert decide({"x": x, "y": y}) is is_true(term, {"x": Fraction(x), "y": Fraction(y)})


def test_underflow_does_not_hide_a_sign() -> None:
    term = t.Compare("<", _constant(0), t.Multiply(X, Y))
    decide = compiled.compile_condition(term, _unit_ranges())
    assert decide({"x": 5e-324, "y": 5e-324}) is True
    assert decide({"x": 5e-324, "y": -5e-324}) is False


def test_products_that_underflow_add_up_to_more_than_the_least_double() -> None:
    """Each is rounded up from 2.6e-324 to 4.9e-324, where nothing larger widens the bound on the error."""
    product = t.Multiply(X, Y)
    term = t.Compare("<=", t.Add(product, t.Add(product, product)), Z)
    tiny, least = Fraction(3, 10**162), Fraction(1, 10**322)
    decide = compiled.compile_condition(term, {**_unit_ranges(tiny), "z": (-least, least)})
    assert decide({"x": 1e-162, "y": 2.6e-162, "z": 2 * 5e-324}) is True
    assert decide({"x": 1e-162, "y": 2.6e-162, "z": 5e-324}) is False


def test_outside_the_rounding_band_the_exact_path_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> bool:
        raise AssertionError("taken")

    monkeypatch.setattr(compiled, "is_true", refuse)
    term = t.Compare("<=", t.Add(t.Multiply(X, Y), Z), _constant("1/2"))
    decide = compiled.compile_condition(term, _unit_ranges())
    assert decide({"x": 0.5, "y": 0.5, "z": 0.1}) is True
    assert decide({"x": 0.5, "y": 0.5, "z": 0.3}) is False
    with pytest.raises(AssertionError, match="taken"):
        decide({"x": 0.5, "y": 0.5, "z": 0.25})


def test_a_hostile_name_stays_a_name() -> None:
    name = "x'] or __import__('os') or v['x"
    odd = t.Variable(name, _NUMBER, t.VariableRole.STATE)
    decide = compiled.compile_condition(t.Compare("<=", odd, _constant(1)), {name: (_ZERO, _ZERO)})
    assert decide({name: 0.0}) is True


def test_generated_code_nests_no_deeper_than_cpython_reads() -> None:
    total: t.Term = X
    for _ in range(250):
        total = t.Conditional(t.Compare("<=", t.Multiply(X, Y), Y), Y, t.Add(total, Y))
        total = t.Extremum("min", total, X)
    decide = compiled.compile_condition(t.Compare("<=", _height_limited(total, 160), X), _unit_ranges())
    assert decide({"x": 0.5, "y": 0.25}) is True


def test_generated_code_of_conditions_in_conditions_nests_no_deeper_either() -> None:
    chosen: t.Term = X
    for _ in range(50):  # three levels each, with four brackets
        chosen = t.Conditional(t.Compare("<=", t.Add(chosen, t.Multiply(X, Y)), Y), X, Y)
    decide = compiled.compile_condition(t.Compare("<=", chosen, X), _unit_ranges())
    assert decide({"x": 0.5, "y": 0.25}) is True


def _height_limited(term: t.Term, height: int) -> t.Term:
    """The subterm of `term` that is about `height` high, found down its longest path."""
    path = [term]
    while children := list(t.children(path[-1])):
        path.append(children[-1] if isinstance(path[-1], t.Conditional) else children[0])
    return path[max(0, len(path) - height)]


def test_functions_of_the_same_source_share_no_code_and_another_source_is_not_taken_for_it() -> None:
    code = compiled.bytecode_of("a + 1", "eval")
    again = compiled.bytecode_of("a + 1", "eval")
    assert again == code
    assert again is not code
    assert [eval(code, {"a": a}) for a in (1, 2)] == [2, 3]  # noqa: S307
    assert eval(compiled.bytecode_of("a + 2", "eval"), {"a": 1}) == 3  # noqa: S307


def test_no_other_term_than_those_of_the_scalar_core_becomes_code() -> None:
    generator = compiled._CodeGenerator(_unit_ranges())
    with pytest.raises(AssertionError, match=r"^not a core condition: "):
        generator.condition(t.Implies(t.TRUE, t.FALSE))
    with pytest.raises(AssertionError, match=r"^not a core real: "):
        generator._real(t.Not(t.TRUE))


def test_generated_code_can_use_nothing_but_numbers() -> None:
    _, names = compiled.inline_conditions([t.Compare("<=", X, Y)], _unit_ranges(), {"x": "x", "y": "y"})
    assert names == {"__builtins__": {}, "abs": abs, "inf": math.inf, "max": max, "min": min}
    assert compiled.bytecode_of("x", "eval").co_filename == "<generated>"


_SUM = t.Add(X, Y)


@pytest.mark.parametrize(
    ("term", "code"),
    [
        (t.Compare("<=", X, _constant("1/10")), "(x <= 0.09999999999999999)"),
        (t.Compare("<", _constant("1/10"), X), "(x > 0.09999999999999999)"),
        (t.Compare("==", X, _constant("1/10")), "False"),
        (t.Compare("<=", X, Y), "(x <= y)"),
        (t.Compare("==", t.Absolute(X), t.Extremum("max", X, Y)), "(abs(x) == max(x, y))"),
    ],
)
def test_measured_values_are_compared_without_a_band(term: t.Term, code: str) -> None:
    local = {name: name for name in "xyz"}
    (found,), names = compiled.inline_conditions([term], _unit_ranges(), local)
    assert (found, len(names)) == (code, 5)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("term", "is_in_band"),
    [
        (t.Multiply(_constant(2), X), True),
        (t.Multiply(_constant(5), X), False),
        (t.Multiply(t.Multiply(X, Y), _constant(1 / compiled._LARGEST)), False),  # on the way
    ],
)
def test_only_values_far_from_overflow_are_subtracted(term: t.Term, is_in_band: bool, turned: bool) -> None:
    quarter = compiled._LARGEST / 4
    ranges = {"x": (-quarter, quarter), "y": (-quarter, quarter), "z": (_ZERO, _ZERO)}
    sides = (Z, term) if turned else (term, Z)
    (code,), _ = compiled.inline_conditions([t.Compare("<=", *sides)], ranges, {name: name for name in "xyz"})
    assert (":=" in code) is is_in_band


def test_both_sides_together_are_far_from_overflow() -> None:
    half = compiled._LARGEST / 2
    for size, is_in_band in ((half, True), (half + 1, False)):
        ranges = {"x": (-size, size), "y": (_ZERO, half)}
        term = t.Compare("<=", t.Extremum("min", X, _constant("1/3")), t.Extremum("max", Y, _constant("1/3")))
        (code,), _ = compiled.inline_conditions([term], ranges, {name: name for name in "xyz"})
        assert (":=" in code) is is_in_band


def test_an_exact_decision_takes_a_value_of_each_variable() -> None:
    names = compiled.inline_conditions(
        [t.Compare("<=", _SUM, Z)], _unit_ranges(), {name: name for name in "xyz"}
    )[1]
    (decide,) = [function for name, function in names.items() if name.startswith("exact")]
    assert decide(0.25, 0.5, 0.75) is True
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        decide(0.25, 0.5)


@pytest.mark.parametrize("height", [28, 29, 58, 59])
def test_every_thirtieth_level_of_a_term_is_a_function(height: int) -> None:
    total: t.Term = X
    for _ in range(height - 1):
        total = t.Add(total, Y)
    term = t.Compare("<=", total, _constant(100))
    (code,), names = compiled.inline_conditions([term], _unit_ranges(), {name: name for name in "xyz"})
    parts = [name for name in names if name.startswith("part")]
    assert len(parts) == (height + 1) // 30
    together = compiled.compile_conditions([term, t.Not(term)], _unit_ranges())
    assert together.argument_names == ("x", "y")
    assert together.evaluate(0.5, 1.0) == (0.5 + height - 1 <= 100, 0.5 + height - 1 > 100)
    assert all(f"{part}(x, y)" in code for part in parts[-1:] if (height + 1) % 30 == 0)


UNIT = Fraction(1, 2**53)
_W = t.Add(t.Add(X, Y), Z)
_TINY = _constant("7e-324")  # is rounded to the least double, 4.9e-324


def _bounds_of(term: t.Term, ranges: Mapping[str, tuple[Fraction, Fraction]]) -> compiled._RealCode:
    return compiled._CodeGenerator(ranges, {name: name for name in "xyz"})._real(term)


@pytest.mark.parametrize(
    ("term", "magnitude", "error"),
    [
        (X, 1, 0),
        (_constant("1/3"), Fraction(1, 3), Fraction(1, 6)),
        (_SUM, 2, 2),
        (_W, 3, 2 + 3),
        (t.Add(_SUM, t.Add(Y, Z)), 4, 2 + 2 + 4),
        (t.Multiply(X, Y), 1, 1),
        (t.Multiply(_SUM, Z), 2, 2 + 2),
        (t.Multiply(_SUM, _W), 6, 2 * 5 + 3 * 2 + 6),
        (t.Extremum("max", _SUM, _W), 3, 5),
        (t.Conditional(t.Compare("<", X, Y), _SUM, X), 2, 2),
        (t.Absolute(_SUM), 2, 2),
    ],
)
def test_errors_are_carried_on_and_each_operation_adds_its_own(
    term: t.Term, magnitude: Fraction | int, error: Fraction | int
) -> None:
    """For variables up to 2^20: each operation rounds by at most half of a unit of its result."""
    size = 2**20
    real = _bounds_of(term, _unit_ranges(Fraction(size)))
    degree = 0 if isinstance(term, t.Literal) else 2 if isinstance(term, t.Multiply) else 1
    assert float(real.magnitude) == pytest.approx(float(magnitude * size**degree))
    assert float(real.error / UNIT) == pytest.approx(float(error * size**degree))


@pytest.mark.parametrize(
    ("term", "values"),
    [
        (_SUM, {"x": 1.0, "y": 2.0**-53 + 2.0**-80}),  # rounded up
        (t.Multiply(X, Y), {"x": 1.5, "y": 1 + 2.0**-52}),  # rounded up
        (t.Multiply(X, Y), {"x": 1.6e-162, "y": 1.6e-162}),  # rounded up to the least double
        (t.Multiply(t.Multiply(_TINY, X), t.Multiply(_TINY, Y)), {"x": 1e300, "y": 1e300}),
        (t.Add(t.Multiply(_TINY, X), t.Multiply(_TINY, Y)), {"x": 1e300, "y": 1e300}),
        (t.Multiply(_TINY, X), {"x": 1e300}),
    ],
)
def test_bounds_hold_at_the_ends_of_the_ranges_where_rounding_is_worst(
    term: t.Term, values: dict[str, float]
) -> None:
    sizes = {name: Fraction(value) for name, value in values.items()}
    ranges = {name: (-size, size) for name, size in sizes.items()}
    real = _bounds_of(term, ranges)
    for signs in product((1, -1), repeat=len(values)):
        point = {name: sign * value for sign, (name, value) in zip(signs, values.items(), strict=True)}
        computed = Fraction(eval(real.code, dict(point)))  # noqa: S307
        exact = cast("Fraction", evaluate(term, {name: Fraction(value) for name, value in point.items()}))
        assert abs(computed - exact) <= real.error
        assert abs(computed) <= real.magnitude <= real.peak


@pytest.mark.parametrize("op", ["<", "<=", "=="])
@pytest.mark.parametrize(
    ("left", "right", "units"),
    [
        (_SUM, Z, 2 + 3),
        (Z, _SUM, 2 + 3),
        (_SUM, t.Add(Y, Z), 2 + 2 + 4),
        (_W, t.Multiply(_constant(1), _SUM), 5 + 4 + 5),
    ],
)
def test_the_band_is_the_error_of_both_sides_and_of_their_difference(
    op: str, left: t.Term, right: t.Term, units: int
) -> None:
    ranges = _unit_ranges(Fraction(2**20))
    term = t.Compare(op, left, right)  # type: ignore[arg-type]
    (code,), _ = compiled.inline_conditions([term], ranges, {name: name for name in "xyz"})
    bands = {abs(float(one)) for one in re.findall(r"<=? -?([0-9.e-]+)", code)}
    assert [band / 2.0**-53 / 2.0**20 for band in bands] == pytest.approx([units])


def test_the_greatest_number_that_may_be_subtracted_is_a_constant_like_others() -> None:
    at_it = _bounds_of(_constant(compiled._LARGEST), {})
    assert at_it.code == f"({float(compiled._LARGEST)!r})"
    assert at_it.error < at_it.peak * UNIT
    beyond = _bounds_of(_constant(compiled._LARGEST + 1), {})
    assert (beyond.error, beyond.peak) == (compiled._LARGEST + 1, compiled._LARGEST + 1)


def test_an_exact_decision_reads_truths_and_members_too() -> None:
    """The value is in the band, where what is chosen depends on a Boolean and on an enumeration."""
    mode, a = VARIABLES["mode"], VARIABLES["a"]
    stop = t.Literal("stop", MODE)
    chosen = t.Conditional(t.And((a, t.Compare("==", mode, stop))), _SUM, _constant(0))
    decide = compiled.compile_condition(t.Compare("==", chosen, Z), _unit_ranges())
    for truth, member, held in ((True, "stop", True), (False, "stop", False), (True, "idle", False)):
        assert decide({"a": truth, "mode": member, "x": 0.25, "y": 0.5, "z": 0.75}) is held


def test_the_height_of_a_part_is_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    total: t.Term = X
    for _ in range(10):
        total = t.Add(total, total)
    seen: list[t.Term] = []
    children = t.children

    def noted(term: t.Term) -> Iterator[t.Term]:
        seen.append(term)
        return children(term)

    monkeypatch.setattr(t, "children", noted)
    assert compiled._CodeGenerator({})._height(total) == 11
    assert len(seen) == 11

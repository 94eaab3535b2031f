from __future__ import annotations

from fractions import Fraction
from math import inf, nan, nextafter
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.runtime.gate.decision import Reason
from aeros.runtime.gate.value_check import (
    Scalars,
    ValueChecker,
    check_freshness,
    check_time,
    unpack_reading,
    value_checkers,
)
from aeros.runtime.ports import Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import FamilyType, IntegerType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from tests.unit.runtime.bench import configuration
from tests.unit.runtime.conftest import METRES, SIDES, declare


def form(name: str) -> ValueChecker:
    return value_checkers(configuration().site.state)[name]


def taken(name: str, value: Any) -> Scalars:
    scalars: Scalars = {}
    assert form(name).unpack(value, scalars) is None
    return scalars


def fault(name: str, value: Any) -> str:
    reason = form(name).unpack(value, {})
    assert reason is not None
    assert reason.rule == name
    return f"{reason.code} {reason.text}"


def real(low: Fraction, high: Fraction, **more: Any) -> Declared:
    return declare("x", METRES, t.VariableRole.STATE, range=(low, high), **more)


def test_values_are_unpacked_into_scalars() -> None:
    assert taken("load", 1) == {"load": 1.0}
    assert type(taken("load", 1)["load"]) is float
    assert taken("hand", [0, 1.5, -2]) == {"hand.x": 0.0, "hand.y": 1.5, "hand.z": -2.0}
    assert taken("joint_ready", (True, False)) == {"joint_ready[shoulder]": True, "joint_ready[elbow]": False}
    assert taken("fitted", "knife") == {"fitted": "knife"}


def test_a_fault_names_the_scalar_in_the_declared_unit() -> None:
    assert fault("hand", (0.0, 0.0, 3.0)) == "AE705 `hand.z` is outside -2 m to 2 m"
    assert fault("joint_angle", (0.0, nan)) == "AE704 `joint_angle[elbow]` is not finite"
    assert fault("dirt", 2.0) == "AE705 `dirt` is outside 0 % to 100 %"
    assert fault("hand", (0.0,)) == "AE704 `hand` is not a list of 3 values"
    assert fault("fitted", "KNIFE") == "AE704 `fitted` is not a member of tools"
    assert fault("stop_pressed", 1) == "AE704 `stop_pressed` is not true or false"
    assert fault("load", True) == "AE704 `load` is not a number"


def test_ranges_are_compared_exactly() -> None:
    tenth = ValueChecker(real(Fraction(-1, 10), Fraction(1, 10)))
    largest = nextafter(0.1, 0.0)
    for value, inside in ((largest, True), (0.1, False), (-largest, True), (-0.1, False), (-0.0, True)):
        assert (tenth.unpack(value, {}) is None) is inside


def test_a_range_beyond_the_doubles_admits_every_finite_one() -> None:
    wide = ValueChecker(real(Fraction(-(10**400)), Fraction(10**400)))
    assert wide.unpack(1.7e308, {}) is None
    assert wide.unpack(inf, {}) is not None


@pytest.mark.parametrize("several", [False, True])
def test_an_integer_admits_only_whole_numbers(several: bool) -> None:
    type_ = IntegerType(NUMBER)
    one = declare(
        "x",
        FamilyType(SIDES, type_) if several else type_,
        t.VariableRole.STATE,
        range=(Fraction(-1), Fraction(3)),
    )
    checker, scalars = ValueChecker(one), dict[str, Any]()
    for value in (-1, 0.0, 3):
        assert checker.unpack((value, value) if several else value, scalars) is None
        assert list(scalars.values()) == [float(value)] * len(checker.names)
    for value in (0.5, 2.9999999999999996):
        reason = checker.unpack((0, value) if several else value, {})
        name = "x[right]" if several else "x"
        assert reason == Reason("AE704", "x", f"`{name}` is not a whole number")
    reason = checker.unpack((0, 4) if several else 4, {})
    assert reason is not None
    assert reason.code == "AE705"


def test_a_time_that_no_clock_shows_is_refused_in_words() -> None:
    text = "the time of the request is not a number of seconds on a clock"
    assert check_time(nan) == Reason("AE704", "time", text)
    assert check_time(2.0**53) is None


def test_a_real_without_a_range_admits_only_zero() -> None:
    none = ValueChecker(declare("x", METRES, t.VariableRole.STATE))
    assert none.unpack(1, {}) == Reason("AE705", "x", "`x` is outside 0 to 0")
    assert none.unpack(0, {}) is None
    assert none.unpack(5e-324, {}) is not None


@pytest.mark.parametrize("whole", [2**53, -(2**53)])
def test_whole_numbers_are_accepted_while_each_is_a_double(whole: int) -> None:
    wide = ValueChecker(real(Fraction(-(2**60)), Fraction(2**60)))
    assert wide.unpack(whole, {}) is None
    beyond = wide.unpack(whole + (1 if whole > 0 else -1), {})
    assert beyond is not None
    assert beyond.code == "AE704"


@pytest.mark.parametrize("time", [0, -1, 2**53, 0.5, -(2.0**53)])
def test_valid_times_are_accepted(time: float) -> None:
    assert check_time(time) is None


@pytest.mark.parametrize("time", [nan, inf, -inf, 2**53 + 1, 2.0**54, True, "0", None, Fraction(1), 10**400])
def test_invalid_times_are_refused(time: Any) -> None:
    reason = check_time(time)
    assert reason is not None
    assert (reason.code, reason.rule) == ("AE704", "time")


@pytest.mark.parametrize("limit", [Fraction(1, 10), Fraction(1, 3), Fraction(1, 10**400), Fraction(10**400)])
@pytest.mark.parametrize("now", [0.0, 1.0, 1e9 + 0.1, 2.0**53])
def test_an_age_is_compared_exactly(limit: Fraction, now: float) -> None:
    aged = ValueChecker(real(Fraction(0), Fraction(1), max_age=limit))
    edge = float(max(Fraction(now) - limit, Fraction(-(2**53))))
    for time in (
        now,
        edge,
        nextafter(edge, -inf),
        nextafter(edge, inf),
        now - float(min(limit, Fraction(1))) / 2,
    ):
        reason = check_freshness(aged, time, now, required=True)
        if abs(time) > 2**53:
            assert reason is not None
        elif time > now:
            assert reason is not None
            assert reason.code == "AE707"
        else:
            assert (reason is None) == (Fraction(now) - Fraction(time) <= limit)


def test_an_age_beyond_the_limit_that_is_rounded_to_the_double_below_it_is_too_old() -> None:
    third = ValueChecker(real(Fraction(0), Fraction(1), max_age=Fraction(1, 3)))
    now, time = 1 / 3, -2.2e-17
    assert now - time == 1 / 3 < Fraction(1, 3) < Fraction(now) - Fraction(time)
    reason = check_freshness(third, time, now, required=True)
    assert reason is not None
    assert reason.code == "AE706"
    assert check_freshness(third, -1.8e-17, now, required=True) is None


def test_a_value_without_a_limit_is_never_too_old() -> None:
    ageless = ValueChecker(real(Fraction(0), Fraction(1)))
    assert check_freshness(ageless, -1e15, 1e15, required=True) is None
    assert check_freshness(ageless, 1, 0, required=True) is not None


def test_a_time_that_cannot_be_used_is_described() -> None:
    aged = ValueChecker(real(Fraction(0), Fraction(1), max_age=Fraction(1, 2)))
    assert check_freshness(aged, "now", 10.0, required=False) == Reason(
        "AE704", "x", "the time of `x` is not a number of seconds on a clock"
    )
    assert check_freshness(aged, 10.5, 10.0, required=False) == Reason(
        "AE707", "x", "`x` was measured in the future"
    )
    assert check_freshness(aged, 8.25, 10.0, required=True) == Reason(
        "AE706", "x", "`x` is 1.75 s old; at most 0.5 s is allowed"
    )
    assert check_freshness(aged, 8.25, 10.0, required=False) is None


@pytest.mark.parametrize(
    ("reading", "fault"),
    [
        (None, "is not measured"),
        (Reading(2.0, 9.75), "is outside 0 to 1"),
        (Reading(0.5, 8.25), "is 1.75 s old; at most 0.5 s is allowed"),
        (Reading(0.5, 10.5), "was measured in the future"),
        (Reading(0.5, nan), "is not a number of seconds on a clock"),
        (0.5, "is not a number of seconds on a clock"),
        (SimpleNamespace(time=9.75), "is not a number"),
        (Reading(0.5, 9.75), None),
    ],
)
def test_a_reading_is_unpacked_or_the_fault_completes_a_sentence(reading: Any, fault: str | None) -> None:
    aged, scalars = ValueChecker(real(Fraction(0), Fraction(1), max_age=Fraction(1, 2))), dict[str, Any]()
    found = unpack_reading(aged, reading, 10.0, scalars)
    assert found == fault
    assert scalars == ({} if fault else {"x": 0.5})

"""Parameters are read once, with their types and ranges; what is left is refused."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import pytest

from aeros.sim.robot.errors import ActionRejectedError
from aeros.sim.robot.motions import ActionParameters


def reading(**values: Any) -> ActionParameters:
    return ActionParameters(values)


@pytest.mark.parametrize("value", [-1.0, 0, 0.5, 2, 2.0])
def test_a_number_in_its_range_is_a_float(value: Any) -> None:
    found = reading(speed=value).number("speed", -1.0, 2.0)
    assert found == value
    assert type(found) is float


@pytest.mark.parametrize("value", [-1.1, 2.1, inf, -inf, 10**400])
def test_a_number_out_of_its_range_is_refused(value: Any) -> None:
    with pytest.raises(ActionRejectedError, match=r"^out of range: `speed` is outside \[-1, 2\]$"):
        reading(speed=value).number("speed", -1.0, 2.0)


@pytest.mark.parametrize("value", [nan, True, "1", None, (1.0,), [1.0]])
def test_values_that_are_no_numbers_are_refused(value: Any) -> None:
    with pytest.raises(ActionRejectedError, match=r"^bad parameter: `speed` is not a number$"):
        reading(speed=value).number("speed", -1.0, 2.0)


def test_a_position_is_three_numbers_up_to_ten_metres() -> None:
    assert reading(target=(1, -10.0, 10)).position("target") == (1.0, -10.0, 10.0)
    assert reading(target=(1.0, 2.0, 3.0)).position("target", 3.0) == (1.0, 2.0, 3.0)
    for value in ((10.1, 0.0, 0.0), (0.0, -10.1, 0.0), (0.0, 0.0, inf)):
        with pytest.raises(ActionRejectedError, match=r"out of range: `target` is outside \[-10, 10\]"):
            reading(target=value).position("target")


@pytest.mark.parametrize("value", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), [1.0, 2.0, 3.0], None, "abc", 1.0])
def test_a_value_that_is_no_triple_is_refused(value: Any) -> None:
    with pytest.raises(ActionRejectedError, match=r"^bad parameter: `target` is not a 3-tuple$"):
        reading(target=value).position("target")
    with pytest.raises(ActionRejectedError, match="`target` is not a number"):
        reading(target=(1.0, None, 2.0)).position("target")


def test_a_string_is_a_string() -> None:
    assert reading(camera="mast").string("camera") == "mast"
    for value in (None, 1, ("mast",), b"mast"):
        with pytest.raises(ActionRejectedError, match=r"^bad parameter: `camera` is not a string$"):
            reading(camera=value).string("camera")


def test_a_parameter_is_there_once() -> None:
    one = reading(speed=1.0)
    one.number("speed", 0.0, 2.0)
    for read in (lambda: one.number("speed", 0.0, 2.0), lambda: one.position("at"), lambda: one.string("at")):
        with pytest.raises(ActionRejectedError, match=r"missing parameter: `(speed|at)`"):
            read()


def test_parameters_that_nobody_read_are_refused_by_the_first_name() -> None:
    one = reading(speed=1.0, b=1, a=2)
    with pytest.raises(ActionRejectedError, match=r"^unknown parameter: `a`$"):
        one.reject_unread()
    reading().reject_unread()


def test_the_callers_mapping_is_left_alone() -> None:
    values = {"speed": 1.0}
    one = ActionParameters(values)
    one.number("speed", 0.0, 2.0)
    one.reject_unread()
    assert values == {"speed": 1.0}

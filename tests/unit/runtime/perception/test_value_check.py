"""Answers of perceivers: whatever is not as declared makes all of the answer unusable."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.isolation.protocol import PerceivedValue
from aeros.runtime.perception.value_check import InvalidValuesError, PerceivedValueCheck
from aeros.runtime.ports import Reading
from tests.unit.runtime.perception.kettle import kettle


def checked(**values: Any) -> dict[str, Any]:
    """Check values of a view from 3 s to 5 s; a tuple is a value with its uncertainty and its time."""
    ecm = kettle()
    check = PerceivedValueCheck(ecm, ecm.perceivers["kettle_view"])
    perceived = {
        name: PerceivedValue(*value) if type(value) is tuple else PerceivedValue(value)
        for name, value in values.items()
    }
    return {name: reading.value for name, reading in check(perceived, 3.0, 5.0).items()}


@pytest.mark.parametrize(("time", "read_at"), [(None, 3.0), (4, 4.0), (5.0, 5.0), (-1.0, -1.0)])
def test_a_value_has_the_time_that_it_states_or_that_of_the_oldest_picture(
    time: float | None, read_at: float
) -> None:
    ecm = kettle()
    check = PerceivedValueCheck(ecm, ecm.perceivers["kettle_view"])
    readings = check({"filled": PerceivedValue(True, None, time)}, 3.0, 5.0)
    assert readings == {"kettle.filled": Reading(True, read_at)}


@pytest.mark.parametrize(
    ("time", "why"),
    [(5.001, "after that of the newest picture"), (nan, "not a number"), ("now", "not a number")],
)
def test_a_time_that_cannot_be_makes_the_answer_unusable(time: Any, why: str) -> None:
    with pytest.raises(InvalidValuesError, match=why):
        checked(filled=(True, None, time))


def test_values_as_declared_get_their_full_names() -> None:
    assert checked(water_hot=True, water_level=(0.12, 0.004)) == {
        "kettle.water_hot": True,
        "kettle.water_level": 0.12,
    }
    assert checked() == {}


def test_whole_numbers_become_numbers() -> None:
    level = checked(water_level=(0, 0))["kettle.water_level"]
    assert type(level) is float


def test_a_value_that_is_less_certain_than_declared_is_unknown() -> None:
    assert checked(water_level=(0.12, 0.005)) == {"kettle.water_level": 0.12}
    assert checked(water_level=(0.12, 0.0051), filled=False) == {"kettle.filled": False}


def test_an_uncertainty_that_nobody_asked_for_is_accepted() -> None:
    assert checked(filled=(True, 0.5)) == {"kettle.filled": True}


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"water_level": (0.31, 0.001)}, "is outside 0 m to 0.3 m"),
        ({"water_level": (-0.001, 0.001)}, "is outside 0 m to 0.3 m"),
        ({"water_level": (nan, 0.001)}, "is not finite"),
        ({"water_level": (inf, 0.001)}, "is not finite"),
        ({"water_level": ("0.1", 0.001)}, "is not a number"),
        ({"water_level": (True, 0.001)}, "is not a number"),
        ({"water_level": ([0.1], 0.001)}, "is not a number"),
        ({"water_level": (None, 0.001)}, "is not a number"),
        ({"water_level": 0.1}, "gave no uncertainty of `kettle.water_level`: yield `estimate"),
        ({"water_level": (0.1, nan)}, "the uncertainty of `kettle.water_level` is not a number"),
        ({"water_level": (0.1, -0.001)}, "the uncertainty of `kettle.water_level` is not a number"),
        ({"water_level": (0.1, inf)}, "the uncertainty of `kettle.water_level` is not a number"),
        ({"water_level": (0.1, "0")}, "the uncertainty of `kettle.water_level` is not a number"),
        ({"water_hot": 1}, "is not true or false"),
        ({"water_hot": None}, "is not true or false"),
        ({"water_cold": True}, "it measured `water_cold`, which it does not provide"),
        ({"kettle.water_hot": True}, "it measured `kettle.water_hot`, which it does not provide"),
        ({"human_distance": 9.0}, "it measured `human_distance`, which it does not provide"),
        ({"water_hot": True, "filled": 2}, "is not true or false"),
    ],
)
def test_an_answer_that_is_not_as_declared_is_refused(values: dict[str, Any], why: str) -> None:
    with pytest.raises(InvalidValuesError, match=why):
        checked(**values)


@given(st.floats(), st.floats())
def test_only_values_in_range_and_certain_enough_pass(value: float, uncertainty: float) -> None:
    try:
        found = checked(water_level=(value, uncertainty))
    except InvalidValuesError:
        assert not (0.0 <= value <= 0.3 and 0.0 <= uncertainty < inf)
    else:
        assert (found == {"kettle.water_level": value}) == (uncertainty <= 0.005)
        assert 0.0 <= value <= 0.3

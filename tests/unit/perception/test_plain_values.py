"""Values that a perceiver yields become plain values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from aeros.perception.plain_values import MAX_VALUES, NoValuesError, plain_values
from aeros.perception.view import Estimate, estimate


@pytest.mark.parametrize(
    ("given", "plain"),
    [
        (True, True),
        (np.True_, True),
        (np.float32(0.5), 0.5),
        (np.float64(0.5), 0.5),
        (np.int16(3), 3),
        ("word", "word"),
        (np.array([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]),
        ((np.float32(1.0), 2.0, np.int8(3)), [1.0, 2.0, 3]),
        (np.array(2.5), 2.5),
    ],
)
def test_numbers_of_numpy_become_pythons_own(given: Any, plain: Any) -> None:
    for yielded, uncertainty in ((given, None), (estimate(given, np.float64(0.25)), 0.25)):
        value, found, time = plain_values({"a": yielded})["a"]
        assert time is None
        parts = value if type(value) is list else [value]
        assert (value, found) == (plain, uncertainty)
        assert {type(part) for part in parts} <= {bool, int, float, str}


def test_none_and_an_estimate_without_a_value_are_unknown() -> None:
    assert plain_values({"a": None, "b": estimate(None, 0.1)}) == {"b": (None, 0.1, None)}


def test_a_value_may_state_its_time() -> None:
    assert plain_values({"a": estimate(True, time=float(np.float32(1.5)))}) == {"a": (True, None, 1.5)}


def test_a_copy_is_made() -> None:
    array = np.array([1.0, 2.0])
    yielded = {"a": array}
    values = plain_values(yielded)
    array[0] = 9.0
    yielded["b"] = array
    assert values == {"a": ([1.0, 2.0], None, None)}


@pytest.mark.parametrize(
    ("yielded", "why"),
    [
        (None, "a `NoneType`, not a dict of values"),
        ([1], "a `list`, not a dict of values"),
        (estimate(1.0, 0.1), "a `Estimate`, not a dict of values"),
        ({1: 2}, "a value whose name is not a string"),
        ({str(n): n for n in range(MAX_VALUES + 1)}, "257 values; at most 256"),
        ({"a": np.zeros(65)}, "an array of 65 numbers"),
        ({"a": Estimate(list(range(65)), 0.1)}, "65 numbers as one value"),
    ],
)
def test_anything_but_values_by_name_is_refused(yielded: object, why: str) -> None:
    with pytest.raises(NoValuesError, match=why):
        plain_values(yielded)

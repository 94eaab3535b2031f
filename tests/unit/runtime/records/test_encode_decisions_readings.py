"""Incremental encoding of readings equals encoding them whole."""

from __future__ import annotations

from math import inf, nan
from random import Random
from typing import Any

import pytest

from aeros.runtime.canonical_json import MAX_SIZE
from aeros.runtime.ports import Reading, Readings
from aeros.runtime.records.encode_decisions import IncrementalReadingsEncoder
from aeros.runtime.records.records import encode_readings

_VALUES = (
    0.0, -0.0, 1, True, False, None, nan, inf, "open", "é", (0.1, 0.2), (True, False), (), [1.0], [[2.0]],
    {"float": "nan"}, 1j, 10**400, ((1.0,), 2.0), "x" * 1000,
)  # fmt: skip
_TIMES: tuple[Any, ...] = (0.0, -0.0, 0.1, 0.1, 3, nan, "noon")


def _snapshot(chance: Random, before: Readings) -> dict[str, Reading]:
    """Readings of which some are the same objects as before, at a time that most of them share."""
    time = chance.choice(_TIMES[: chance.choice((5, 7))])
    snapshot = {}
    for name in chance.sample(["lid", "pot", "float", "é", "aim", "tool"], chance.randint(0, 6)):
        kept = before.get(name)
        value = kept.value if kept is not None and chance.random() < 0.7 else chance.choice(_VALUES)
        snapshot[name] = Reading(value, time if chance.random() < 0.95 else chance.choice(_TIMES))
    return snapshot


def test_incremental_encoding_of_readings_equals_encode_readings() -> None:
    chance = Random(5)  # noqa: S311 - a test, the same every time
    encoder = IncrementalReadingsEncoder()
    snapshot: dict[str, Reading] = {}
    for _ in range(3000):
        snapshot = _snapshot(chance, snapshot)
        assert encoder.encode(snapshot) == encode_readings(snapshot)


def test_a_changed_list_is_encoded_anew() -> None:
    encoder, place = IncrementalReadingsEncoder(), [1.0]
    snapshot = {"place": Reading(place, 0.0), "lid": Reading(True, 0.0)}
    first = encoder.encode(snapshot)
    place[0] = 2.0
    assert encoder.encode(snapshot) == encode_readings(snapshot) != first


@pytest.mark.parametrize(
    "strange", [{1: Reading(1.0, 0.0), "lid": Reading(1.0, 0.0)}, {None: Reading(1.0, 0.0)}]
)
def test_readings_with_odd_names_are_encoded_by_the_definition(strange: Any) -> None:
    assert IncrementalReadingsEncoder().encode(strange) == encode_readings(strange)


def test_readings_larger_than_a_record_are_marked_as_too_large() -> None:
    snapshot = {name: Reading(name * (MAX_SIZE // 2), 0.0) for name in "abc"}
    encoder = IncrementalReadingsEncoder()
    assert encoder.encode(snapshot) == encoder.encode(snapshot) == encode_readings(snapshot)
    assert "too large" in encoder.encode(snapshot).text


def test_names_without_end_leave_no_more_behind_than_is_needed() -> None:
    encoder = IncrementalReadingsEncoder()
    for number in range(30_000):
        encoder.encode({f"name {number}": Reading(1.0, 0.0), "lid": Reading(True, 0.0)})
    assert len(encoder._texts) == 2

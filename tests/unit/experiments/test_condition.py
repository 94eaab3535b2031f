"""Conditions as data: equal settings are one condition, whatever their order."""

from __future__ import annotations

import hashlib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.experiments.condition import TrialCondition

SETTINGS: dict[str, Any] = {"rate": "3/10", "options": {"b": 1, "a": [1, 2]}, "policy": True}


def test_the_order_of_settings_does_not_matter() -> None:
    one = TrialCondition.create("task", "symbolic", SETTINGS)
    other = TrialCondition.create("task", "symbolic", dict(reversed(SETTINGS.items())))
    assert one == other
    assert hash(one) == hash(other)
    assert one.canonical_json == '{"options":{"a":[1,2],"b":1},"policy":true,"rate":"3/10"}'


def test_settings_are_read_anew_each_time() -> None:
    condition = TrialCondition.create("task", "symbolic", SETTINGS)
    assert condition.settings == SETTINGS
    condition.settings["rate"] = "1"
    assert condition.settings == SETTINGS


def test_the_digest_is_of_kind_plant_settings_and_premises() -> None:
    condition = TrialCondition("task", "symbolic", "{}")
    assert condition.digest("p") == hashlib.sha256(b"task\nsymbolic\n{}\np").hexdigest()[:32]
    others = [
        TrialCondition("kills", "symbolic", "{}").digest("p"),
        TrialCondition("task", "physics", "{}").digest("p"),
        TrialCondition("task", "symbolic", '{"a":1}').digest("p"),
        condition.digest("q"),
    ]
    assert len({condition.digest("p"), *others}) == 5


@given(st.dictionaries(st.text(max_size=4), st.integers() | st.booleans() | st.text(max_size=4), max_size=4))
def test_settings_are_what_was_given(settings: dict[str, Any]) -> None:
    assert TrialCondition.create("task", "symbolic", settings).settings == settings

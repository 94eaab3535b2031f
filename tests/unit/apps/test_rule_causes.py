"""Causes are read from records; what has another form is left out."""

from __future__ import annotations

import pytest

from aeros.apps.rule_causes import RuleCause, Shortfall, read_causes

NEAR = {"quantity": "human_distance", "value": 0.61, "bound": 0.89, "asked": "at least", "unit": "m"}


def test_causes_have_the_values_that_broke_them() -> None:
    recorded = [{"rule": "arm-standing", "text": "human_distance >= 0.89 m", "shortfalls": [NEAR]}]
    shortfall = Shortfall("human_distance", 0.61, 0.89, False, "m")
    assert read_causes(recorded) == (RuleCause("arm-standing", "human_distance >= 0.89 m", (shortfall,)),)


@pytest.mark.parametrize(
    ("recorded", "count"),
    [
        (None, 0),
        ("text", 0),
        ([1, None], 0),
        ([{"rule": "a"}], 1),
        ([{"rule": "a", "shortfalls": [{}, {**NEAR, "value": None}, {**NEAR, "bound": float("nan")}]}], 1),
    ],
)
def test_causes_of_another_form_are_left_out(recorded: object, count: int) -> None:
    causes = read_causes(recorded)
    assert len(causes) == count
    assert all(one.shortfalls == () for one in causes)

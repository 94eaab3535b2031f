"""The text about a stop names what it came to, and passes over what has another form."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.apps.stop_text import stop_text

DETAILS: dict[str, Any] = {
    "reason": "collision-force",
    "began": 1.0,
    "time": 1.25,
    "ways": {"tool_position": 0.014},
    "quantities": {
        "contact_force": {"least": 3.0, "greatest": 121.5, "unit": "N"},
        "human_distance": {"least": 1.75, "greatest": 2.0, "unit": "m"},
    },
}


def test_it_names_time_way_greatest_force_and_least_distance() -> None:
    assert stop_text(DETAILS) == (
        "stopped: collision-force; at rest after 0.250 s; tool_position moved 0.014 m; "
        "greatest contact_force 122 N; least human_distance 1.75 m"
    )


@pytest.mark.parametrize("odd", [None, "x", [1], {"a": 3}, {"a": {"greatest": "much"}}, float("nan")])
def test_fields_of_another_form_are_left_out(odd: Any) -> None:
    for name in DETAILS:
        assert stop_text(DETAILS | {name: odd}).startswith("stopped: ")

"""Quantities with their bounds: while the actions that rules are about are under way, and not longer."""

from __future__ import annotations

import json
from math import isnan
from typing import Any

import pytest

from aeros.runtime.bus.messages import BoundedQuantity
from aeros.runtime.bus.names import check_ros_name
from aeros.runtime.bus.viewer.bound_messages import BoundMessages, boundable_quantities
from aeros.runtime.ports import Reading
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path

PARAMETERS = {"target": [0.3, -1.2, 0.45], "speed": 0.1, "yaw": 0.0}
ENDED = {"module": "m", "skill": "s", "status": "finished"}


@pytest.fixture(scope="module")
def cell() -> Site:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site


def record(event: str, details: dict[str, Any]) -> bytes:
    return json.dumps({"event": event, "sequence": 1, "details": details}).encode()


def opened(site: Site, configuration: str = "c") -> bytes:
    return record("session-opened", {"configuration": configuration, "site": {"digest": site.digest}})


def decided(parameters: dict[str, Any] | None, configuration: str = "c") -> bytes:
    action = None if parameters is None else {"kind": "move_tool", "parameters": parameters}
    return record(
        "decision", {"module": "m", "skill": "s", "configuration": configuration, "decided": action}
    )


def measured(
    messages: BoundMessages, time: float, distance: float = 2.0, joints: float = 0.5
) -> dict[str, BoundedQuantity]:
    readings = {
        "human_distance": Reading(distance, time),
        "tool_speed": Reading(0.25, time),
        "link_speed": Reading(0.25, time),
        "joint_velocity": Reading((joints,) * 7, time),
    }
    return dict(messages.measure(readings))


def test_every_quantity_that_rules_compare_has_a_topic(cell: Site) -> None:
    found = {one.name: one for one in boundable_quantities(cell)}
    assert found["tool_speed"].topic == "/aeros/bounds/measured/tool_speed"
    assert found["joint_velocity[j2]"].topic == "/aeros/bounds/measured/joint_velocity/j2"
    assert found["move_tool.speed"][1:] == ("/aeros/bounds/requested/move_tool/speed", "m/s")
    assert "holding" not in found
    for one in found.values():
        check_ros_name(one.topic)


def test_bounds_are_those_of_the_action_under_way(cell: Site) -> None:
    messages = BoundMessages(cell)
    messages.note_record(opened(cell))
    before = measured(messages, 1.0)
    assert before["tool_speed"].value == 0.25
    assert isnan(before["tool_speed"].upper)
    assert before["tool_speed"].upper_rule == ""
    messages.note_record(decided(PARAMETERS))
    during = measured(messages, 2.0)
    assert (during["tool_speed"].upper, during["tool_speed"].upper_rule) == (1.7, "tool-speed")
    # A person at 2 m: links must be slow, and of two bounds the tighter one counts.
    assert (during["link_speed"].upper, during["link_speed"].upper_rule) == (0.25, "link-speeds-near-person")
    assert during["human_distance"].lower_rule == "arm-separation"
    assert (during["move_tool.speed"].value, during["move_tool.speed"].upper) == (0.1, 0.2)
    speed = during["joint_velocity[j1]"]
    assert speed.lower == -speed.upper < 0.0
    assert speed.lower_rule == speed.upper_rule == "joint-speeds"
    assert during["tool_speed"].header.stamp.sec == 2
    messages.note_record(record("step-ended", ENDED))
    after = measured(messages, 3.0)
    assert isnan(after["tool_speed"].upper)
    assert isnan(after["move_tool.speed"].value)
    assert "move_tool.speed" not in measured(messages, 4.0)


def test_a_denied_action_is_not_under_way(cell: Site) -> None:
    messages = BoundMessages(cell)
    messages.note_record(opened(cell))
    messages.note_record(decided(None))
    assert isnan(measured(messages, 1.0)["tool_speed"].upper)


def test_rules_of_another_site_bound_nothing(cell: Site) -> None:
    messages = BoundMessages(cell)
    messages.note_record(opened(cell))
    messages.note_record(decided(PARAMETERS, "other"))
    assert isnan(measured(messages, 1.0)["tool_speed"].upper)


def test_messages_come_ten_times_a_second(cell: Site) -> None:
    messages = BoundMessages(cell)
    times = [number / 240 for number in range(240)]
    assert sum(bool(measured(messages, time)) for time in times) == 10
    assert measured(messages, 0.5)  # the clock began anew


@pytest.mark.parametrize("last", [Reading(2.0, 1.0), Reading(float("nan"), 2.0), Reading("near", 2.0)])
def test_an_unknown_value_is_not_shown_as_the_last_one_known(cell: Site, last: Reading) -> None:
    messages = BoundMessages(cell)
    messages.note_record(opened(cell))
    messages.note_record(decided(PARAMETERS))
    assert measured(messages, 1.0)["human_distance"].value == 2.0
    assert measured(messages, 1.2)["link_speed"].upper_rule == "link-speeds-near-person"
    later = {"human_distance": last, "link_speed": Reading(0.25, 2.0)}
    found = dict(messages.measure(later))
    assert found["link_speed"].value == 0.25
    assert found["link_speed"].upper_rule != "link-speeds-near-person"
    assert "human_distance" not in found


def test_a_value_measured_between_two_messages_counts(cell: Site) -> None:
    messages = BoundMessages(cell)
    assert measured(messages, 1.0)
    assert measured(messages, 1.05, distance=3.0) == {}
    found = dict(messages.measure({"tool_speed": Reading(0.1, 1.12)}))
    assert (found["human_distance"].value, found["tool_speed"].value) == (3.0, 0.1)


@pytest.mark.parametrize("line", [b"no record", b"{"])
def test_other_lines_are_ignored(cell: Site, line: bytes) -> None:
    messages = BoundMessages(cell)
    messages.note_record(line)
    assert dict(messages.measure({})) == {}
    assert dict(messages.measure({"tool_speed": Reading(1.0, float("nan"))})) == {}

"""The encoding of messages, their definitions, and their time."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from aeros.runtime.bus.cdr import CdrEncoder, plant_nanoseconds
from aeros.runtime.bus.messages import Event, Header, JointState, Message, String, Time
from tests.unit.runtime.bus.test_messages import STORE, plain


@pytest.mark.parametrize(
    "message",
    [
        JointState(Header(Time(3)), ("a", "b"), (1.0, 2.0), (), (0.5, -0.5)),
        Event(Time(1, 2), 7, "note", '{"a":"ü"}'),
        String("<robot/>"),
    ],
)
def test_a_message_is_read_back_by_ros_and_its_definition_names_its_fields(message: Message) -> None:
    encoder = CdrEncoder()
    there: Any = STORE.deserialize_cdr(bytes(encoder.encode(message)), message.ros)
    assert msgspec.convert(plain(there), type(message)) == message
    definition = encoder.definition(type(message))
    assert all(name in definition for name in type(message).__struct_fields__)


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        (Event(Time(3, 5), 1, "note", "{}"), 3_000_000_005),
        (JointState(Header(Time(-1)), (), (), (), ()), 0),
        (String("x"), 0),
    ],
)
def test_a_message_has_the_time_of_its_first_stamp(message: Message, expected: int) -> None:
    assert plant_nanoseconds(message) == expected

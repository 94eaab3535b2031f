"""Messages arrive as they were sent, to the last bit; anything malformed ends the connection."""

from __future__ import annotations

import json
import socket
import struct
from collections.abc import Iterator
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.ports import (
    Ball,
    CameraPicture,
    CameraView,
    Hull,
    MotionCompletion,
    NoMotion,
    Reading,
    RobotBody,
    ServoBounds,
    Trajectory,
)
from aeros.sim.hosting.wire import (
    ConnectionLostError,
    MessageChannel,
    decode_body,
    decode_picture,
    decode_plan,
    decode_value,
    encode_body,
    encode_picture,
    encode_plan,
    encode_value,
)

BODY = RobotBody(
    ((0.0, 0.5, 0.25),),
    (0.0, 0.0, 0.1),
    (Ball("hand", 1, (0.0, 0.0, 0.2), 0.1),),
    (Hull("hand", 1, ((0.0, 0.0, 0.2), (0.0, 0.1, 0.2)), 0.05), Hull("foot", 0, ((0.0, 0.0, 0.0),), 0.1)),
    (("foot", "hand"),),
)
PLAN = Trajectory(BODY, ((((0.0,), (0.1,), (0.2,), (0.3,)),),), (1.0, 2.0, 3.0), (0.0, 0.5, 0.0), 4.0)
SERVO = ServoBounds((0.1,), (1.0,), (2.0,), (3.0,), 0.4, 0.5, 0.6)


@pytest.fixture
def ends() -> Iterator[tuple[MessageChannel, socket.socket]]:
    """A channel, and the raw other end."""
    ours, theirs = socket.socketpair()
    channel = MessageChannel(ours, 0.2)
    yield channel, theirs
    channel.close()
    channel.close()
    theirs.close()


def frame(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


def test_a_message_is_its_length_and_json(ends: tuple[MessageChannel, socket.socket]) -> None:
    channel, raw = ends
    channel.send({"do": "now"})
    assert raw.recv(100) == b'\x0d\x00\x00\x00{"do": "now"}'
    raw.sendall(frame(b'{"is": [1, 2.5, "x", null, true]}'))
    assert channel.receive() == {"is": [1, 2.5, "x", None, True]}


def test_messages_follow_each_other_in_pieces(ends: tuple[MessageChannel, socket.socket]) -> None:
    channel, raw = ends
    both = frame(b'{"a": 1}') + frame(b'{"b": "%s"}' % (b"x" * 2000))
    for part in (both[:3], both[3:15], both[15:]):
        raw.sendall(part)
    assert channel.receive() == {"a": 1}
    assert channel.receive() == {"b": "x" * 2000}


def test_numbers_of_numpy_are_sent_as_plain_numbers(
    ends: tuple[MessageChannel, socket.socket],
) -> None:
    channel, raw = ends
    channel.send({"speed": np.float32(0.5), "count": np.int64(3), "far": inf})
    assert json.loads(raw.recv(200)[4:]) == {"speed": 0.5, "count": 3.0, "far": inf}
    with pytest.raises(TypeError):
        channel.send({"odd": object()})


@pytest.mark.parametrize(
    ("sent", "why"),
    [
        (frame(b"not json"), "received data is not a message: "),
        (frame(b"\xff"), "received data is not a message: "),
        (frame(b"[1]"), "received data is not a message"),
        (frame(b"17"), "received data is not a message"),
        (struct.pack("<I", 64 * 1024 * 1024 + 1), "message of 67108865 bytes exceeds the limit of 67108864"),
        (b"\x05\x00", "cannot receive: timed out"),
        (b"\x05\x00\x00\x00{", "cannot receive: timed out"),
        (b"", "cannot receive: timed out"),
    ],
)
def test_bytes_that_are_no_message_end_the_connection(
    sent: bytes, why: str, ends: tuple[MessageChannel, socket.socket]
) -> None:
    channel, raw = ends
    raw.sendall(sent)
    with pytest.raises(ConnectionLostError, match=why):
        channel.receive()


def test_an_end_that_is_gone_is_noticed_by_either_call(ends: tuple[MessageChannel, socket.socket]) -> None:
    channel, raw = ends
    raw.close()
    with pytest.raises(ConnectionLostError, match="connection closed by peer"):
        channel.receive()
    with pytest.raises(ConnectionLostError, match="cannot send"):
        channel.send({"do": "now"})


_VALUES = st.recursive(
    st.booleans() | st.none() | st.text() | st.integers() | st.floats(allow_nan=False),
    lambda parts: st.lists(parts, max_size=3).map(tuple),
)


def _arrived(value: Any) -> Any:
    """The value after it was text."""
    return decode_value(json.loads(json.dumps(encode_value(value))))


@given(_VALUES)
def test_values_arrive_unchanged(value: Any) -> None:
    arrived = _arrived(value)
    assert arrived == value
    assert repr(arrived) == repr(value)


def test_readings_arrive_as_readings() -> None:
    reading = Reading((1.0, (2.0, 3.0)), 4.0)
    assert encode_value(reading) == {"reading": [(1.0, (2.0, 3.0)), 4.0]}
    arrived = _arrived(encode_value(reading))
    assert arrived == reading
    assert type(arrived) is Reading
    assert decode_value([{"reading": [[1], 2.0]}]) == (Reading((1,), 2.0),)
    for odd in ({}, {"other": 1}):
        with pytest.raises(KeyError):
            decode_value(odd)


@pytest.mark.parametrize(
    "plan",
    [
        MotionCompletion(True),
        MotionCompletion(False, "unreachable: too far"),
        NoMotion("look: nothing moves"),
        PLAN,
        replace(PLAN, servo=SERVO, joint_paths=PLAN.joint_paths * 2),
    ],
)
def test_a_plan_arrives_as_it_was_made(plan: Any) -> None:
    message = json.loads(json.dumps(encode_plan(plan)))
    assert decode_plan(message, BODY) == plan


def test_a_trajectory_needs_a_body_that_was_sent() -> None:
    with pytest.raises(ConnectionLostError, match="a body that was never sent"):
        decode_plan(encode_plan(PLAN), None)
    assert decode_plan(encode_plan(NoMotion("still")), None) == NoMotion("still")


def test_a_body_arrives_as_it_is() -> None:
    assert decode_body(json.loads(json.dumps(encode_body(BODY)))) == BODY


@pytest.mark.parametrize("has_depth", [True, False])
def test_a_picture_survives_the_way_as_json(has_depth: bool) -> None:
    view = CameraView((0.1, 0.2, 0.3), (0.0, 1e-300, 0.0), (0.0, 0.0, 1.0), 45.5)
    depth = bytes(range(24)) if has_depth else None
    picture = CameraPicture("mast", 1.0 / 3.0, 3, 2, bytes(range(18)), depth, view)
    assert decode_picture(json.loads(json.dumps(encode_picture(picture)))) == picture

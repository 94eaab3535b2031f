"""Frames between runtime and worker: nothing but one well-formed answer to the question is accepted."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator
from functools import partial
from math import isnan, nan
from threading import Thread
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.isolation.protocol import (
    MAX_REQUEST_BYTES,
    MAX_RESPONSE_BYTES,
    MAX_TEXT_LENGTH,
    ActionRequested,
    CloseSkill,
    LoadSkill,
    ProtocolError,
    ResponseTimeoutError,
    ResumeSkill,
    SkillClosed,
    SkillFinished,
    SkillLoaded,
    SkillRaised,
    SkillRejected,
    WorkerConnection,
    WorkerEndedError,
    decode_response,
    encode,
    receive_request,
    sanitize_text,
    send_response,
)
from aeros.runtime.skills.code import CodeFile

TOKEN = b"0123456789abcdef"


def payload(message: Any) -> bytes:
    return encode(message)[4:]


def frame(content: bytes) -> bytes:
    return len(content).to_bytes(4, "big") + content


# Frames.


def test_a_frame_begins_with_the_length_of_its_payload() -> None:
    data = encode(SkillLoaded(TOKEN))
    assert data[:4] == bytes([0, 0, 0, len(data) - 4])
    long = encode(SkillRaised(TOKEN, "x" * 1000))
    assert long[:4] == (len(long) - 4).to_bytes(4, "big")
    assert msgspec.msgpack.decode(data[4:]) == {"type": "SkillLoaded", "token": TOKEN}


@pytest.mark.parametrize(
    "answer",
    [
        SkillLoaded(TOKEN),
        SkillRejected(TOKEN, "no"),
        ActionRequested(TOKEN, "move", {"speed": 0.5, "at": [1, 2.0], "gently": True, "tool": None}),
        SkillFinished(TOKEN),
        SkillFinished(TOKEN, {"found": True}),
        SkillRaised(TOKEN, "ValueError: ü"),
        SkillClosed(TOKEN, None),
    ],
)
def test_a_response_is_decoded_as_it_was_encoded(answer: Any) -> None:
    assert decode_response(payload(answer), TOKEN) == answer


def test_a_number_that_is_none_arrives_for_the_gate_to_decide() -> None:
    answer = decode_response(payload(ActionRequested(TOKEN, "move", {"speed": nan})), TOKEN)
    assert isinstance(answer, ActionRequested)
    speed = answer.parameters["speed"]
    assert isinstance(speed, float)
    assert isnan(speed)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xc1",
        payload(SkillLoaded(TOKEN))[:-1],
        payload(SkillLoaded(TOKEN)) + b"\x00",
        payload(CloseSkill(TOKEN)),
        msgspec.msgpack.encode({"type": "SkillLoaded"}),
        msgspec.msgpack.encode({"type": "SkillLoaded", "token": TOKEN, "more": 1}),
        msgspec.msgpack.encode({"type": "SkillLoaded", "token": "text"}),
        msgspec.msgpack.encode({"type": "SkillRaised", "token": TOKEN, "reason": 3}),
        msgspec.msgpack.encode({"type": "ActionRequested", "token": TOKEN, "kind": "m", "parameters": [1]}),
        msgspec.msgpack.encode(
            {"type": "ActionRequested", "token": TOKEN, "kind": "m", "parameters": {"a": {"b": 1}}}
        ),
        b"\x91" * 100_000,
        b"\x83\xa4type\xabSkillRaised\xa5token\xc4\x01x\xa6reason\xa1\xff",
    ],
)
def test_a_malformed_response_is_a_violation(content: bytes) -> None:
    with pytest.raises(ProtocolError, match="its answer is malformed"):
        decode_response(content, TOKEN)


def test_a_response_with_another_token_is_a_violation() -> None:
    with pytest.raises(ProtocolError, match="does not belong to the latest request"):
        decode_response(payload(SkillLoaded(TOKEN[::-1])), TOKEN)


@given(st.binary(max_size=60))
def test_no_bytes_raise_anything_else(content: bytes) -> None:
    with pytest.raises(ProtocolError):
        decode_response(content, TOKEN)


# The runtime's end.


class Worker:
    """The other end of a connection, which answers from a thread."""

    def __init__(self) -> None:
        ours, self.channel = socket.socketpair()
        self.connection = WorkerConnection(ours)

    def ask(self, answer: Callable[[Any], bytes], seconds: float = 20.0) -> Any:
        """Ask, and have what `answer` makes of the request sent back."""

        def respond() -> None:
            self.channel.sendall(answer(receive_request(self.channel.fileno())))

        thread = Thread(target=respond)
        thread.start()
        try:
            return self.connection.request(CloseSkill(self.connection.token()), seconds)
        finally:
            thread.join(20.0)


@pytest.fixture
def worker() -> Iterator[Worker]:
    made = Worker()
    yield made
    made.connection.close()
    made.connection.close()
    made.channel.close()


def _say(what: bytes, request: Any) -> bytes:
    return what


def closed(request: Any) -> bytes:
    return encode(SkillClosed(request.token, None))


def test_a_request_is_answered_again_and_again(worker: Worker) -> None:
    began = time.monotonic()
    for _ in range(4):
        assert isinstance(worker.ask(closed), SkillClosed)
    assert time.monotonic() - began < 3.0


def test_tokens_are_fresh() -> None:
    tokens = {WorkerConnection.token() for _ in range(50)}
    assert len(tokens) == 50
    assert {len(token) for token in tokens} == {16}


def test_the_longest_response_is_accepted_and_a_longer_one_is_not_read(worker: Worker) -> None:
    def long(size: int) -> Callable[[Any], bytes]:
        def respond(request: Any) -> bytes:
            shorter = len(payload(SkillRaised(request.token, "x" * 40_000)))
            return encode(SkillRaised(request.token, "x" * (40_000 + size - shorter)))

        return respond

    answer = worker.ask(long(MAX_RESPONSE_BYTES))
    assert isinstance(answer, SkillRaised)
    with pytest.raises(ProtocolError, match=f"has {MAX_RESPONSE_BYTES + 1} bytes, more than"):
        worker.ask(long(MAX_RESPONSE_BYTES + 1))


def test_an_answer_that_goes_on_is_a_violation(worker: Worker) -> None:
    with pytest.raises(ProtocolError, match="it sent more than one answer"):
        worker.ask(lambda request: closed(request) + b"!")


def test_an_answer_before_the_question_is_a_violation(worker: Worker) -> None:
    worker.channel.sendall(encode(SkillClosed(TOKEN, None)))
    with pytest.raises(ProtocolError, match="does not belong to the latest request"):
        worker.ask(lambda request: b"")


def test_a_worker_that_says_nothing_or_half_of_it_is_late(worker: Worker) -> None:
    for expected in (b"", b"\x00", b"\x00\x00\x00\x09half"):
        began = time.monotonic()
        with pytest.raises(ResponseTimeoutError, match="it does not answer"):
            worker.ask(partial(_say, expected), 0.02)
        assert 0.02 <= time.monotonic() - began < 10.0


def test_a_worker_that_drips_is_late(worker: Worker) -> None:
    def drip() -> None:
        for byte in frame(b"x" * 30):
            worker.channel.send(bytes([byte]))
            time.sleep(0.005)

    thread = Thread(target=drip)
    thread.start()
    with pytest.raises(ResponseTimeoutError):
        worker.connection.request(CloseSkill(TOKEN), 0.05)
    thread.join(20.0)


def test_a_worker_that_hangs_up_has_ended(worker: Worker) -> None:
    worker.channel.close()
    with pytest.raises(WorkerEndedError, match="its process ended"):
        worker.connection.request(CloseSkill(TOKEN), 20.0)


def test_a_worker_that_hangs_up_within_its_answer_has_ended(worker: Worker) -> None:
    worker.channel.sendall(b"\x00\x00\x00\x09half")
    worker.channel.shutdown(socket.SHUT_WR)
    with pytest.raises(WorkerEndedError):
        worker.connection.request(CloseSkill(TOKEN), 20.0)


def test_a_worker_may_hang_up_after_its_answer(worker: Worker) -> None:
    token = WorkerConnection.token()
    worker.channel.sendall(encode(SkillClosed(token, None)))
    worker.channel.shutdown(socket.SHUT_WR)
    assert worker.connection.request(CloseSkill(token), 20.0) == SkillClosed(token, None)


def load(size: int) -> LoadSkill:
    return LoadSkill(TOKEN, (), CodeFile("m", "s.py", "/s.py", b"#" * size), "lift", {})


def test_a_request_has_a_limit_too(worker: Worker) -> None:
    header = len(payload(load(100_000))) - 100_000
    with pytest.raises(ProtocolError, match="the request to it has more than 35651584 bytes"):
        worker.connection.request(load(MAX_REQUEST_BYTES - header + 1), 0.02)
    # One that is just short enough fills the buffer of a worker that does not read.
    with pytest.raises(ResponseTimeoutError, match="it does not read requests"):
        worker.connection.request(load(MAX_REQUEST_BYTES - header), 0.02)


# The worker's end.


def test_requests_are_received_in_order_until_the_runtime_hangs_up() -> None:
    read, write = os.pipe()
    requests = [
        LoadSkill(
            TOKEN,
            ("seccomp",),
            CodeFile("m", "s.py", "/s.py", b"code", (("a.py", b"more"),)),
            "lift",
            {"at": (1.0, 2.0), "n": 3},
        ),
        ResumeSkill(TOKEN, {"near": 1.5, "seen": None}),
        CloseSkill(TOKEN),
    ]
    for request in requests:
        os.write(write, encode(request))
    os.write(write, b"\x00\x00\x00\x05ab")
    os.close(write)
    assert [receive_request(read) for _ in range(3)] == requests
    assert receive_request(read) is None
    assert receive_request(read) is None
    os.close(read)


def test_a_request_that_arrives_in_pieces_is_put_together() -> None:
    read, write = os.pipe()
    data = encode(ResumeSkill(TOKEN, {"near": 1.5}))

    def drip() -> None:
        for byte in data:
            os.write(write, bytes([byte]))
            time.sleep(0.0002)

    thread = Thread(target=drip)
    thread.start()
    assert receive_request(read) == ResumeSkill(TOKEN, {"near": 1.5})
    thread.join(20.0)
    os.close(read)
    os.close(write)


def test_a_request_that_arrives_with_the_next_one_is_taken_alone() -> None:
    read, write = os.pipe()
    first, second = ResumeSkill(TOKEN, {"near": 1.5}), ResumeSkill(TOKEN, {"near": 2.5})
    data = encode(first) + encode(second)
    os.write(write, data[:9])

    def go_on() -> None:
        time.sleep(0.02)
        os.write(write, data[9:])

    thread = Thread(target=go_on)
    thread.start()
    assert [receive_request(read), receive_request(read)] == [first, second]
    thread.join(20.0)
    os.close(read)
    os.close(write)


def test_a_response_is_sent_whole_even_in_short_writes(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[bytes] = []

    def short(descriptor: int, data: bytes) -> int:
        assert descriptor == 5
        written.append(data[:3])
        return len(written[-1])

    monkeypatch.setattr(os, "write", short)
    send_response(5, b"0123456789")
    assert written == [b"012", b"345", b"678", b"9"]


# Texts.


def test_a_text_is_shortened_and_its_surrogates_are_escaped() -> None:
    assert sanitize_text("ü is fine") == "ü is fine"
    assert sanitize_text("a\udc80b") == "a\\udc80b"
    assert sanitize_text("x" * (MAX_TEXT_LENGTH + 1)) == "x" * 1000


@given(st.text(st.characters(exclude_categories=())))
def test_every_text_fits_into_a_frame(text: str) -> None:
    assert encode(SkillRaised(TOKEN, sanitize_text(text)))

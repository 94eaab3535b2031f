"""What runtime and worker say to each other: length-prefixed MessagePack of a closed schema.

    frame := length:uint32 payload          length is that of the payload, big-endian, and capped

A worker is believed in nothing.  A frame of it is read up to a cap and a deadline, decoded to plain
values of exactly the types below, and must carry the token of the question it answers, which nobody can
know before it was asked: so no answer can be sent ahead, or twice.  Floats may be NaN or infinite:
what a value is worth, the gate decides.
"""

from __future__ import annotations

import os
import selectors
import socket
import time
from typing import Final

import msgspec

MAX_RESPONSE_BYTES: Final = 64 * 1024
"""Bytes of one answer of a worker at most; an action takes about a hundred."""

MAX_REQUEST_BYTES: Final = 1024 * 1024
"""Bytes of one question to a worker at most; the longest holds a file of skill code."""

TOKEN_BYTES: Final = 16
"""Bytes of a token."""

MAX_TEXT_LENGTH: Final = 1000
"""Characters of one text that people read."""

_PREFIX: Final = 4

JsonValue = None | bool | int | float | str
"""One value of an observation, an input or a parameter, if it is no vector."""


class WorkerMessage(msgspec.Struct, frozen=True, tag=True, forbid_unknown_fields=True):
    """Every frame carries the token of its exchange."""

    token: bytes


class LoadSkill(WorkerMessage, frozen=True):
    """Lock down, then execute `source`, the file `name` of `module`, and find its generator function."""

    layers: tuple[str, ...]
    module: str
    name: str
    path: str
    source: bytes
    function: str
    inputs: dict[str, JsonValue | tuple[JsonValue, ...]]


class ResumeSkill(WorkerMessage, frozen=True):
    """Run the skill up to its next action."""

    observation: dict[str, JsonValue | tuple[JsonValue, ...]]


class CloseSkill(WorkerMessage, frozen=True):
    """Close the generator, so that its own clean-up runs."""


class SkillLoaded(WorkerMessage, frozen=True):
    """The skill is ready."""


class SkillRejected(WorkerMessage, frozen=True):
    """The code cannot be run, and why."""

    reason: str


class ActionRequested(WorkerMessage, frozen=True):
    """The skill asks for an action."""

    kind: str
    parameters: dict[str, JsonValue | list[JsonValue]]


class SkillFinished(WorkerMessage, frozen=True):
    """The skill ran to its end, and what it returned."""

    outputs: dict[str, JsonValue | list[JsonValue]] | None = None


class SkillRaised(WorkerMessage, frozen=True):
    """The skill's code failed, and how in words."""

    reason: str


class SkillClosed(WorkerMessage, frozen=True):
    """The generator is closed; what its clean-up raised, in words."""

    error: str | None


RuntimeRequest = LoadSkill | ResumeSkill | CloseSkill
WorkerResponse = SkillLoaded | SkillRejected | ActionRequested | SkillFinished | SkillRaised | SkillClosed

_REQUEST_DECODER: Final[msgspec.msgpack.Decoder[RuntimeRequest]] = msgspec.msgpack.Decoder(RuntimeRequest)
_RESPONSE_DECODER: Final[msgspec.msgpack.Decoder[WorkerResponse]] = msgspec.msgpack.Decoder(WorkerResponse)
_ENCODER: Final = msgspec.msgpack.Encoder()


class ProtocolError(Exception):
    """The worker did not answer as agreed; the message says what it did instead."""


class ResponseTimeoutError(ProtocolError):
    """The worker did not answer in time."""


class WorkerGoneError(ProtocolError):
    """The worker is gone."""


def encode(frame: WorkerMessage) -> bytes:
    """`frame` with its prefix.  Raises what msgspec raises for values that the schema lacks."""
    payload = _ENCODER.encode(frame)
    return len(payload).to_bytes(_PREFIX, "big") + payload


def decode_response(payload: bytes, token: bytes) -> WorkerResponse:
    """The answer in `payload` to the question that bore `token`; raises `ProtocolError`."""
    try:
        answer = _RESPONSE_DECODER.decode(payload)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as failure:
        raise ProtocolError(f"its answer is malformed: {str(failure)[:200]}") from failure
    if answer.token != token:
        raise ProtocolError("its answer belongs to no question, or to an earlier one")
    return answer


class WorkerConnection:
    """The runtime's end: one question, then one answer within a deadline, in turn."""

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        channel.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(channel, selectors.EVENT_READ)

    @staticmethod
    def token() -> bytes:
        """A token for one exchange that nobody can guess."""
        return os.urandom(TOKEN_BYTES)

    def request(self, question: RuntimeRequest, seconds: float) -> WorkerResponse:
        """The worker's answer, which may take `seconds` of real time; raises `ProtocolError`."""
        deadline = time.monotonic() + seconds
        self._send(encode(question), deadline)
        length = int.from_bytes(self._receive(_PREFIX, deadline), "big")
        if length > MAX_RESPONSE_BYTES:
            raise ProtocolError(f"its answer has {length} bytes, more than {MAX_RESPONSE_BYTES}")
        answer = decode_response(self._receive(length, deadline), question.token)
        if self._is_readable(0) and self._peek():
            raise ProtocolError("it says more than it was asked")
        return answer

    def close(self) -> None:
        """Hang up; safe to call twice."""
        self._selector.close()
        self._channel.close()

    def _send(self, data: bytes, deadline: float) -> None:
        if len(data) > _PREFIX + MAX_REQUEST_BYTES:
            raise ProtocolError(f"what it is to be told has more than {MAX_REQUEST_BYTES} bytes")
        # The channel is empty but for this question, so it takes one that is not larger than its buffer.
        self._channel.settimeout(max(deadline - time.monotonic(), 0.001))
        try:
            self._channel.sendall(data)
        except TimeoutError as failure:
            raise ResponseTimeoutError("it does not listen") from failure
        except OSError as failure:
            raise WorkerGoneError("its process ended") from failure
        finally:
            self._channel.setblocking(False)

    def _receive(self, length: int, deadline: float) -> bytes:
        heard = bytearray()
        while len(heard) < length:
            if not self._is_readable(deadline - time.monotonic()):
                raise ResponseTimeoutError("it does not answer")
            try:
                part = self._channel.recv(length - len(heard))
            except OSError as failure:
                raise WorkerGoneError("its process ended") from failure
            if not part:
                raise WorkerGoneError("its process ended")
            heard += part
        return bytes(heard)

    def _peek(self) -> bytes:
        """What comes next; nothing if the worker hung up, as it may after its last answer."""
        try:
            return self._channel.recv(1, socket.MSG_PEEK)
        except OSError:
            return b""

    def _is_readable(self, seconds: float) -> bool:
        return seconds >= 0 and bool(self._selector.select(seconds))


def receive_request(descriptor: int) -> RuntimeRequest | None:
    """The worker's end: the next question, or None when the runtime has hung up."""
    prefix = _read(descriptor, _PREFIX)
    if prefix is None:
        return None
    payload = _read(descriptor, int.from_bytes(prefix, "big"))
    return None if payload is None else _REQUEST_DECODER.decode(payload)


def send_response(descriptor: int, data: bytes) -> None:
    """The worker's end: send an encoded answer."""
    while data:
        data = data[os.write(descriptor, data) :]


def _read(descriptor: int, length: int) -> bytes | None:
    read = b""
    while len(read) < length:
        part = os.read(descriptor, length - len(read))
        if not part:
            return None
        read += part
    return read


def sanitize_text(text: str) -> str:
    """`text`, so short and so plain that a frame holds it."""
    return text[:MAX_TEXT_LENGTH].encode("utf-8", "backslashreplace").decode()

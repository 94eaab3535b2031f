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

MOST_ANSWER: Final = 64 * 1024
"""Bytes of one answer of a worker at most; an action takes about a hundred."""

MOST_QUESTION: Final = 1024 * 1024
"""Bytes of one question to a worker at most; the longest holds a file of skill code."""

TOKEN: Final = 16
"""Bytes of a token."""

MOST_WORDS: Final = 1000
"""Characters of one text that people read."""

_PREFIX: Final = 4

Plain = None | bool | int | float | str
"""One value of an observation, an input or a parameter, if it is no vector."""


class Frame(msgspec.Struct, frozen=True, tag=True, forbid_unknown_fields=True):
    """Every frame carries the token of its exchange."""

    token: bytes


class Load(Frame, frozen=True):
    """Lock down, then execute `source`, the file `name` of `module`, and find its generator function."""

    layers: tuple[str, ...]
    module: str
    name: str
    path: str
    source: bytes
    function: str
    inputs: dict[str, Plain | tuple[Plain, ...]]


class Resume(Frame, frozen=True):
    """Run the skill up to its next action."""

    observed: dict[str, Plain | tuple[Plain, ...]]


class Close(Frame, frozen=True):
    """Close the generator, so that its own clean-up runs."""


class Loaded(Frame, frozen=True):
    """The skill is ready."""


class Refused(Frame, frozen=True):
    """The code cannot be run, and why."""

    reason: str


class Asked(Frame, frozen=True):
    """The skill asks for an action."""

    kind: str
    parameters: dict[str, Plain | list[Plain]]


class Finished(Frame, frozen=True):
    """The skill ran to its end, and what it returned."""

    outputs: dict[str, Plain | list[Plain]] | None = None


class Raised(Frame, frozen=True):
    """The skill's code failed, and how in words."""

    reason: str


class Closed(Frame, frozen=True):
    """The generator is closed; what its clean-up raised, in words."""

    complaint: str | None


Question = Load | Resume | Close
Answer = Loaded | Refused | Asked | Finished | Raised | Closed

_QUESTIONS: Final[msgspec.msgpack.Decoder[Question]] = msgspec.msgpack.Decoder(Question)
_ANSWERS: Final[msgspec.msgpack.Decoder[Answer]] = msgspec.msgpack.Decoder(Answer)
_ENCODER: Final = msgspec.msgpack.Encoder()


class ConversationError(Exception):
    """The worker did not answer as agreed; the message says what it did instead."""


class LateError(ConversationError):
    """The worker did not answer in time."""


class EndedError(ConversationError):
    """The worker is gone."""


def encode(frame: Frame) -> bytes:
    """`frame` with its prefix.  Raises what msgspec raises for values that the schema lacks."""
    payload = _ENCODER.encode(frame)
    return len(payload).to_bytes(_PREFIX, "big") + payload


def decode_answer(payload: bytes, token: bytes) -> Answer:
    """The answer in `payload` to the question that bore `token`; raises `ConversationError`."""
    try:
        answer = _ANSWERS.decode(payload)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as failure:
        raise ConversationError(f"its answer is malformed: {str(failure)[:200]}") from failure
    if answer.token != token:
        raise ConversationError("its answer belongs to no question, or to an earlier one")
    return answer


class Conversation:
    """The runtime's end: one question, then one answer within a deadline, in turn."""

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        channel.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(channel, selectors.EVENT_READ)

    @staticmethod
    def token() -> bytes:
        """A token for one exchange that nobody can guess."""
        return os.urandom(TOKEN)

    def ask(self, question: Question, seconds: float) -> Answer:
        """The worker's answer, which may take `seconds` of real time; raises `ConversationError`."""
        deadline = time.monotonic() + seconds
        self._say(encode(question), deadline)
        length = int.from_bytes(self._hear(_PREFIX, deadline), "big")
        if length > MOST_ANSWER:
            raise ConversationError(f"its answer has {length} bytes, more than {MOST_ANSWER}")
        answer = decode_answer(self._hear(length, deadline), question.token)
        if self._is_readable(0) and self._peek():
            raise ConversationError("it says more than it was asked")
        return answer

    def close(self) -> None:
        """Hang up; safe to call twice."""
        self._selector.close()
        self._channel.close()

    def _say(self, data: bytes, deadline: float) -> None:
        if len(data) > _PREFIX + MOST_QUESTION:
            raise ConversationError(f"what it is to be told has more than {MOST_QUESTION} bytes")
        # The channel is empty but for this question, so it takes one that is not larger than its buffer.
        self._channel.settimeout(max(deadline - time.monotonic(), 0.001))
        try:
            self._channel.sendall(data)
        except TimeoutError as failure:
            raise LateError("it does not listen") from failure
        except OSError as failure:
            raise EndedError("its process ended") from failure
        finally:
            self._channel.setblocking(False)

    def _hear(self, length: int, deadline: float) -> bytes:
        heard = bytearray()
        while len(heard) < length:
            if not self._is_readable(deadline - time.monotonic()):
                raise LateError("it does not answer")
            try:
                part = self._channel.recv(length - len(heard))
            except OSError as failure:
                raise EndedError("its process ended") from failure
            if not part:
                raise EndedError("its process ended")
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


def hear_question(descriptor: int) -> Question | None:
    """The worker's end: the next question, or None when the runtime has hung up."""
    prefix = _read(descriptor, _PREFIX)
    if prefix is None:
        return None
    payload = _read(descriptor, int.from_bytes(prefix, "big"))
    return None if payload is None else _QUESTIONS.decode(payload)


def answer(descriptor: int, data: bytes) -> None:
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


def words(text: str) -> str:
    """`text`, so short and so plain that a frame holds it."""
    return text[:MOST_WORDS].encode("utf-8", "backslashreplace").decode()

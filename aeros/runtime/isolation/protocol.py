"""Protocol between runtime and worker: length-prefixed MessagePack with a closed schema.

    frame := length:uint32 payload          length is that of the payload, big-endian, and capped

Nothing that a worker sends is trusted. Its frame is read up to a size limit and a deadline, and decoded to
plain values of exactly the types below. It must carry the token of the request it answers, which nobody can
know before the request: so no response can be sent ahead, or twice. Floats may be NaN or infinite; the gate
checks values.
"""

from __future__ import annotations

import os
import selectors
import socket
import time
from typing import Final

import msgspec

from aeros.models.interface import ModelPackage
from aeros.runtime.isolation.limits import MEMORY
from aeros.runtime.skills.code import CodeFile

MAX_RESPONSE_BYTES: Final = 64 * 1024
"""Limit on the bytes of one response of a worker; an action takes about a hundred."""

MAX_REQUEST_BYTES: Final = 34 * 1024 * 1024
"""Limit on the bytes of one request to a worker; the longest holds the code of a module and its models."""

TOKEN_BYTES: Final = 16
"""Bytes of a token."""

MAX_TEXT_LENGTH: Final = 1000
"""Limit on the characters of one text for people."""

_PREFIX: Final = 4

JsonValue = None | bool | int | float | str

TableRow = dict[str, JsonValue | tuple[JsonValue, ...]]
"""One row of a table, as perceivers get it: an object of the site, or where a thing was seen."""
"""One scalar of an observation, an input or a parameter."""


class WorkerMessage(msgspec.Struct, frozen=True, tag=True, forbid_unknown_fields=True):
    """A message in either direction.

    Attributes:
        token: random bytes of the request; its response carries the same ones.
    """

    token: bytes


class LoadSkill(WorkerMessage, frozen=True):
    """Request to lock the process down, execute a file of skill code, and find its generator function.

    Attributes:
        layers: names of the isolation layers to apply before the code runs.
        file: the file, and those that it may import.
        function: name of the generator function.
        inputs: inputs of the skill by name, SI.
        models: the models that the skill declares.
        memory: greatest memory beyond the zygote's, bytes.
    """

    layers: tuple[str, ...]
    file: CodeFile
    function: str
    inputs: dict[str, JsonValue | tuple[JsonValue, ...]]
    models: tuple[ModelPackage, ...] = ()
    memory: int = MEMORY


class ResumeSkill(WorkerMessage, frozen=True):
    """Request to run the skill up to its next action.

    Attributes:
        observation: values that the skill may sense, by name, SI.
        denial: why its last action was denied for good; empty if it was not.
    """

    observation: dict[str, JsonValue | tuple[JsonValue, ...]]
    denial: str = ""


class CloseSkill(WorkerMessage, frozen=True):
    """Request to close the generator, so that its own clean-up runs."""


class PictureSlot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Place of a camera's picture in the memory that runtime and worker share.

    Attributes:
        camera: name of the camera.
        width: number of columns, pixels.
        height: number of rows, pixels.
        rgb: offset of the colours, 3 bytes a pixel.
        depth: offset of the depth, a float32 a pixel; None if there is none.
    """

    camera: str
    width: int
    height: int
    rgb: int
    depth: int | None


class PictureFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Time and place of a picture, whose pixels are in the shared memory.

    Attributes:
        time: plant time at which it was taken, s.
        eye: position of the camera in W, m.
        target: point in W that it looks at, m.
        up: direction in W that is up in the picture.
        field_of_view: vertical, degrees.
        full_size: width and height of the picture of which it is a sample, pixels.
    """

    time: float
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    field_of_view: float
    full_size: tuple[int, int]


class LoadPerceiver(WorkerMessage, frozen=True):
    """Request to lock the process down, execute a file of perceivers, and find a generator function in it.

    Attributes:
        layers: names of the isolation layers to apply before the code runs.
        memory: greatest memory beyond the zygote's, bytes.
        file: the file, and those that it may import.
        function: name of the generator function.
        members: members that the code may import, by module.
        builtins: builtins that it may use.
        slots: places of its pictures in the shared memory, in order.
        size: bytes of the shared memory.
        models: the models that the perceiver declares.
    """

    layers: tuple[str, ...]
    memory: int
    file: CodeFile
    function: str
    members: dict[str, tuple[str, ...]]
    builtins: tuple[str, ...]
    slots: tuple[PictureSlot, ...]
    size: int
    models: tuple[ModelPackage, ...] = ()


class ResumePerceiver(WorkerMessage, frozen=True):
    """Request to compute values from a new view.

    Attributes:
        time: plant time, s.
        readings: values by the module's name for the variable, SI; a table by its name.
        samples: time and value of each sampled reading, oldest first, by the same names.
        pictures: facts of the picture in each slot; None where the camera has taken none.
    """

    time: float
    readings: dict[str, JsonValue | tuple[JsonValue, ...] | dict[str, TableRow]]
    samples: dict[str, tuple[tuple[float, JsonValue | tuple[JsonValue, ...]], ...]]
    pictures: tuple[PictureFacts | None, ...]


class SkillLoaded(WorkerMessage, frozen=True):
    """Response: the skill or the perceiver is ready."""


class SkillRejected(WorkerMessage, frozen=True):
    """Response: the code cannot be run.

    Attributes:
        reason: reason in words.
    """

    reason: str


class ActionRequested(WorkerMessage, frozen=True):
    """Response: the skill asks for an action.

    Attributes:
        kind: action kind.
        parameters: parameters by name, SI.
    """

    kind: str
    parameters: dict[str, JsonValue | list[JsonValue]]


class SkillFinished(WorkerMessage, frozen=True):
    """Response: the skill ran to its end.

    Attributes:
        outputs: outputs by name; None if it returned none.
    """

    outputs: dict[str, JsonValue | list[JsonValue]] | None = None


class SkillRaised(WorkerMessage, frozen=True):
    """Response: the skill's code raised an exception.

    Attributes:
        reason: description of the exception.
    """

    reason: str


class SkillDenied(WorkerMessage, frozen=True):
    """Response: the skill did not catch the denial of an action.

    Attributes:
        denials: number of its denials that no other way made up for.
    """

    denials: int


class SkillClosed(WorkerMessage, frozen=True):
    """Response: the generator is closed.

    Attributes:
        error: description of the exception that its clean-up raised; None if it raised none.
    """

    error: str | None


class PerceivedValue(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A value that a perceiver computed.

    Attributes:
        value: SI.
        uncertainty: standard uncertainty, SI; None if the perceiver gave none.
        time: plant time at which it was true, s; None if the perceiver gave none.
    """

    value: JsonValue | list[JsonValue]
    uncertainty: JsonValue = None
    time: JsonValue = None


class ValuesPerceived(WorkerMessage, frozen=True):
    """Response: the perceiver computed values.

    Attributes:
        values: values by the module's name for the variable; unknown ones are absent.
    """

    values: dict[str, PerceivedValue]


RuntimeRequest = LoadSkill | ResumeSkill | CloseSkill | LoadPerceiver | ResumePerceiver
WorkerResponse = (
    SkillLoaded
    | SkillRejected
    | ActionRequested
    | SkillFinished
    | SkillRaised
    | SkillDenied
    | SkillClosed
    | ValuesPerceived
)

_REQUEST_DECODER: Final[msgspec.msgpack.Decoder[RuntimeRequest]] = msgspec.msgpack.Decoder(RuntimeRequest)
_RESPONSE_DECODER: Final[msgspec.msgpack.Decoder[WorkerResponse]] = msgspec.msgpack.Decoder(WorkerResponse)
_ENCODER: Final = msgspec.msgpack.Encoder()


class ProtocolError(Exception):
    """The worker violated the protocol; the message says how."""


class ResponseTimeoutError(ProtocolError):
    """The worker did not answer in time."""


class WorkerEndedError(ProtocolError):
    """The worker's process ended."""


def encode(frame: WorkerMessage) -> bytes:
    """Encode a message as a frame.

    Args:
        frame: the message.

    Returns:
        Length prefix and payload.

    Raises:
        TypeError: the schema lacks a value; msgspec may raise ValueError and OverflowError too.
    """
    payload = _ENCODER.encode(frame)
    return len(payload).to_bytes(_PREFIX, "big") + payload


def decode_response(payload: bytes, token: bytes) -> WorkerResponse:
    """Decode a response.

    Args:
        payload: frame without its prefix.
        token: token of the request.

    Returns:
        The response.

    Raises:
        ProtocolError: it is malformed, or carries another token.
    """
    try:
        answer = _RESPONSE_DECODER.decode(payload)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as failure:
        raise ProtocolError(f"its answer is malformed: {str(failure)[:200]}") from failure
    if answer.token != token:
        raise ProtocolError("its answer does not belong to the latest request")
    return answer


class WorkerConnection:
    """The runtime's end of the channel: one request, then one response before a deadline, in turn."""

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        channel.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(channel, selectors.EVENT_READ)

    @staticmethod
    def token() -> bytes:
        """Make a token for one exchange.

        Returns:
            `TOKEN_BYTES` random bytes, which nobody can guess.
        """
        return os.urandom(TOKEN_BYTES)

    def request(self, question: RuntimeRequest, seconds: float) -> WorkerResponse:
        """Send a request and wait for the response.

        Args:
            question: the request, with a fresh token.
            seconds: limit on the whole exchange, s of real time.

        Returns:
            The response.

        Raises:
            ProtocolError: the response is malformed, too long or not the only one.
            ResponseTimeoutError: it is late.
            WorkerEndedError: the worker's process ended.
        """
        deadline = time.monotonic() + seconds
        self._send(encode(question), deadline)
        length = int.from_bytes(self._receive(_PREFIX, deadline), "big")
        if length > MAX_RESPONSE_BYTES:
            raise ProtocolError(f"its answer has {length} bytes, more than {MAX_RESPONSE_BYTES}")
        answer = decode_response(self._receive(length, deadline), question.token)
        if self._is_readable(0) and self._peek():
            raise ProtocolError("it sent more than one answer")
        return answer

    def close(self) -> None:
        """Hang up; safe to call twice."""
        self._selector.close()
        self._channel.close()

    def _send(self, data: bytes, deadline: float) -> None:
        if len(data) > _PREFIX + MAX_REQUEST_BYTES:
            raise ProtocolError(f"the request to it has more than {MAX_REQUEST_BYTES} bytes")
        # The channel is empty, so a request that fits into its buffer is sent at once; one with models is
        # not.
        self._channel.settimeout(max(deadline - time.monotonic(), 0.001))
        try:
            self._channel.sendall(data)
        except TimeoutError as failure:
            raise ResponseTimeoutError("it does not read requests") from failure
        except OSError as failure:
            raise WorkerEndedError("its process ended") from failure
        finally:
            self._channel.setblocking(False)

    def _receive(self, length: int, deadline: float) -> bytes:
        received = bytearray()
        while len(received) < length:
            if not self._is_readable(deadline - time.monotonic()):
                raise ResponseTimeoutError("it does not answer")
            try:
                part = self._channel.recv(length - len(received))
            except OSError as failure:
                raise WorkerEndedError("its process ended") from failure
            if not part:
                raise WorkerEndedError("its process ended")
            received += part
        return bytes(received)

    def _peek(self) -> bytes:
        """Return the next byte without consuming it; empty if the worker hung up, as it may after its end."""
        try:
            return self._channel.recv(1, socket.MSG_PEEK)
        except OSError:
            return b""

    def _is_readable(self, seconds: float) -> bool:
        return seconds >= 0 and bool(self._selector.select(seconds))


def receive_request(descriptor: int) -> RuntimeRequest | None:
    """Receive the next request, at the worker's end.

    Args:
        descriptor: the channel.

    Returns:
        The request; None if the runtime has hung up.
    """
    prefix = _read(descriptor, _PREFIX)
    if prefix is None:
        return None
    payload = _read(descriptor, int.from_bytes(prefix, "big"))
    return None if payload is None else _REQUEST_DECODER.decode(payload)


def send_response(descriptor: int, data: bytes) -> None:
    """Send an encoded response, at the worker's end.

    Args:
        descriptor: the channel.
        data: frame from `encode`.
    """
    while data:
        data = data[os.write(descriptor, data) :]


def _read(descriptor: int, length: int) -> bytes | None:
    read = bytearray()
    while len(read) < length:
        part = os.read(descriptor, length - len(read))
        if not part:
            return None
        read += part
    return bytes(read)


def sanitize_text(text: str) -> str:
    """Shorten and escape a text so that a frame can hold it.

    Args:
        text: any text.

    Returns:
        At most `MAX_TEXT_LENGTH` characters of it, with surrogates escaped.
    """
    return text[:MAX_TEXT_LENGTH].encode("utf-8", "backslashreplace").decode()

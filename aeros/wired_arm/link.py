"""Messages between the plant and its processes, over a pair of Unix sockets that keep messages whole.

The first byte tells the kind. States and the acknowledgements of states cross a thousand times a second, so
these are packed; a path is packed as it is long; everything else is JSON.
"""

from __future__ import annotations

import json
import select
import socket
import struct
import time
from array import array
from collections.abc import Sequence
from functools import cache
from typing import Any, Final, NamedTuple

from aeros.wired_arm.arm import ArmState
from aeros.wired_arm.streamed_motion import PathPiece

_JUDGED: Final = struct.Struct("<cd")
_PATH: Final = struct.Struct("<cdB")
_COLUMNS: Final = 5
"""Numbers of a state for each joint."""

_BUFFER_BYTES: Final = 1 << 20
_LARGEST: Final = 1 << 18
"""Size of the sockets' buffers and of the largest message, bytes."""

_REPORT_TIMEOUT: Final = 1.0
_REPORT_PAUSE: Final = 0.001
"""Longest wait for room for a report, and time between looks, s."""


class StateMessage(NamedTuple):
    """A state of the robot.

    Attributes:
        state: the state.
        is_controlled: True if positions are commanded.
    """

    state: ArmState
    is_controlled: bool


class JudgedMessage(NamedTuple):
    """Statement of the plant that its monitor has judged all states up to one.

    Attributes:
        time: of that state, s.
    """

    time: float


class StartMessage(NamedTuple):
    """Order to begin a motion.

    Attributes:
        path: Bézier pieces, rad.
        duration: s.
    """

    path: tuple[PathPiece, ...]
    duration: float


Message = StateMessage | JudgedMessage | StartMessage | dict[str, Any]
"""A message; everything that is not packed is a dictionary of JSON values with a key `is`."""


class LinkClosedError(Exception):
    """The other end of the link is gone."""


class ProcessLink:
    """One end of a link.

    Args:
        end: a Unix socket that keeps messages whole.
    """

    def __init__(self, end: socket.socket) -> None:
        self._socket = end
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)

    def fileno(self) -> int:
        """Return the socket's file descriptor, to wait on.

        Returns:
            The descriptor.
        """
        return self._socket.fileno()

    def send(self, message: Message) -> bool:
        """Send a message without waiting.

        Args:
            message: the message.

        Returns:
            False if the other end has not read for so long that there is no room.

        Raises:
            LinkClosedError: the other end is gone.
        """
        try:
            self._socket.send(encode(message), socket.MSG_DONTWAIT)
        except BlockingIOError:
            return False
        except OSError as failure:
            raise LinkClosedError(str(failure)) from failure
        return True

    def report(self, kind: str, **details: Any) -> None:
        """Send a message that the other end must get; wait for room.

        Args:
            kind: tells what happened.
            details: JSON values by name.

        Raises:
            LinkClosedError: the other end is gone, or has not read for a second.
        """
        latest = time.monotonic() + _REPORT_TIMEOUT
        while not self.send(event(kind, **details)):
            if time.monotonic() > latest:
                raise LinkClosedError("the other end does not read")
            time.sleep(_REPORT_PAUSE)

    def receive(self, timeout: float = 0.0) -> Message | None:
        """Receive a message.

        Args:
            timeout: longest time to wait, s.

        Returns:
            The message; None if there is none.

        Raises:
            LinkClosedError: the other end is gone, and everything that it sent has been read.
        """
        try:
            if timeout > 0.0 and not select.select([self._socket], [], [], timeout)[0]:
                return None
            data = self._read()
        except BlockingIOError:
            return None
        except OSError as failure:
            raise LinkClosedError(str(failure)) from failure
        if not data:
            raise LinkClosedError("the other process has ended")
        return decode(data)

    def _read(self) -> bytes:
        try:
            return self._socket.recv(_LARGEST, socket.MSG_DONTWAIT)
        except ConnectionResetError:
            # The other end was closed with messages unread: reported once, before its last messages.
            return self._socket.recv(_LARGEST, socket.MSG_DONTWAIT)

    def close(self) -> None:
        """Close this end."""
        self._socket.close()


def open_link() -> tuple[ProcessLink, socket.socket]:
    """Make a link.

    Returns:
        This end, and the socket of the other end, for the process that gets it.
    """
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    return ProcessLink(here), there


def encode(message: Message) -> bytes:
    """Write a message as bytes.

    Args:
        message: the message.

    Returns:
        The bytes.
    """
    if isinstance(message, StateMessage):
        one = message.state
        columns = (*one.q, *one.dq, *one.q_d, *one.torque, *one.external_torque)
        form = _state_form(len(columns))
        return form.pack(b"S", one.time, *columns, one.mode, one.success_rate, message.is_controlled)
    if isinstance(message, JudgedMessage):
        return _JUDGED.pack(b"T", message.time)
    if isinstance(message, StartMessage):
        numbers = array("d", [value for piece in message.path for corner in piece for value in corner])
        return _PATH.pack(b"P", message.duration, len(message.path[0][0])) + numbers.tobytes()
    return b"J" + json.dumps(message).encode()


def decode(data: bytes) -> Message:
    """Read a message from bytes.

    Args:
        data: what `encode` wrote.

    Returns:
        The message.

    Raises:
        LinkClosedError: these are no bytes of a message, as only another program would send.
    """
    try:
        if data[:1] == b"S":
            count = (len(data) - _state_form(0).size) // (8 * _COLUMNS)
            _, when, *numbers, mode, rate, is_controlled = _state_form(_COLUMNS * count).unpack(data)
            q, dq, q_d, torque, external = (
                tuple(numbers[column * count : (column + 1) * count]) for column in range(_COLUMNS)
            )
            return StateMessage(ArmState(when, q, dq, q_d, torque, external, mode, rate), is_controlled)
        if data[:1] == b"T":
            return JudgedMessage(_JUDGED.unpack(data)[1])
        if data[:1] == b"P":
            _, duration, count = _PATH.unpack(data[: _PATH.size])
            return StartMessage(_path_of(data[_PATH.size :], count), duration)
        return dict(json.loads(data[1:]))
    except (struct.error, ValueError, TypeError) as failure:
        raise LinkClosedError(f"a message of {len(data)} bytes cannot be read: {failure}") from failure


def event(kind: str, **details: Any) -> dict[str, Any]:
    """Make a message that is not packed.

    Args:
        kind: tells what happened, or what to do.
        details: JSON values by name.

    Returns:
        The message.
    """
    return {"is": kind, **details}


@cache
def _state_form(numbers: int) -> struct.Struct:
    """Return the form of a state with so many numbers of joints."""
    return struct.Struct(f"<cd{numbers}dBd?")


def _path_of(data: bytes, joints: int) -> tuple[PathPiece, ...]:
    numbers = array("d")
    numbers.frombytes(data)
    corners: Sequence[tuple[float, ...]] = [
        tuple(numbers[first : first + joints]) for first in range(0, len(numbers), max(1, joints))
    ]
    if not corners or len(corners) % 4 or len(numbers) % max(1, joints):
        raise ValueError(f"{len(numbers)} numbers are no path")
    return tuple(
        (corners[first], corners[first + 1], corners[first + 2], corners[first + 3])
        for first in range(0, len(corners), 4)
    )

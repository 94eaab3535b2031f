"""Keys that are pressed in a terminal, and changes of its size, while a view is shown there."""

from __future__ import annotations

import os
import select
import signal
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_SEQUENCES: Final = {
    b"\x1b[A": "up",
    b"\x1b[B": "down",
    b"\x1b[5~": "page up",
    b"\x1b[6~": "page down",
    b"\x1b[H": "home",
    b"\x1b[1~": "home",
    b"\x1b[F": "end",
    b"\x1b[4~": "end",
    b"\x1bOA": "up",
    b"\x1bOB": "down",
    b"\x1bOH": "home",
    b"\x1bOF": "end",
}

_READ: Final = 1024
"""Most bytes that are read at a time."""

_ESCAPE_TIME: Final = 0.05
"""Time in which the rest of an escape sequence comes, s; after it, Escape was pressed alone."""


class Keyboard:
    """Keys of a terminal.

    Args:
        source: file descriptor of the terminal; None if there is none to read keys from.
        wake: file descriptor that is readable once a signal has come.
    """

    def __init__(self, source: int | None, wake: int) -> None:
        self._source, self._wake = source, wake
        self._unfinished = b""
        """Beginning of a sequence whose end has not come in time."""

    @property
    def is_there(self) -> bool:
        """True if keys can be pressed."""
        return self._source is not None

    def wait(self, seconds: float) -> list[str]:
        """Wait for keys, or a change of the terminal's size.

        Args:
            seconds: longest time to wait.

        Returns:
            The keys that were pressed, by name or character; none if none was.
        """
        watched = [self._wake] if self._source is None else [self._wake, self._source]
        ready, _, _ = select.select(watched, [], [], seconds)
        if self._wake in ready:
            os.read(self._wake, _READ)
        if self._source is None or self._source not in ready:
            return []
        data = os.read(self._source, _READ)
        if not data:
            self._source = None  # The terminal is gone.
            return []
        while open_sequence(data) and select.select([self._source], [], [], _ESCAPE_TIME)[0]:
            more = os.read(self._source, _READ)
            if not more:
                break
            data += more
        late, self._unfinished = self._unfinished, b""
        keys = parse_keys(late + data)
        rest = open_sequence(late + data)
        if len(rest) > 1:
            # A slow line: no letter of what is still to come may count as a key.
            self._unfinished = rest
        return pressed_alone(keys)


def parse_keys(data: bytes) -> list[str]:
    """Parse what a terminal sends for keys.

    Args:
        data: the bytes.

    Returns:
        Names of keys, and characters. Escape and each unknown sequence are one key, `unknown`: no letter of a
        sequence counts as a key, and any of them answers a question with no.
    """
    keys: list[str] = []
    place = 0
    while place < len(data):
        if data[place] != 0x1B:
            keys.append(data[place : place + 1].decode("latin-1"))
            place += 1
            continue
        end = _sequence_end(data, place)
        keys.append(_SEQUENCES.get(data[place:end], "unknown"))
        place = end
    return keys


def open_sequence(data: bytes) -> bytes:
    """Find an escape sequence at the end that lacks its end.

    Args:
        data: the bytes.

    Returns:
        What there is of it, from Escape on; nothing if the last sequence is complete.
    """
    start = data.rfind(b"\x1b")
    rest = data[start:] if start >= 0 else b""
    if rest in (b"\x1b", b"\x1bO"):
        return rest
    is_open = rest.startswith(b"\x1b[") and not any(0x40 <= one <= 0x7E for one in rest[2:])
    return rest if is_open else b""


def pressed_alone(keys: list[str]) -> list[str]:
    """Take different characters that came at once for pasted text, which commands nothing.

    Args:
        keys: keys that came at once.

    Returns:
        The keys, or `unknown` alone.
    """
    return ["unknown"] if len({one for one in keys if len(one) == 1}) > 1 else keys


def _sequence_end(data: bytes, start: int) -> int:
    """Return where an escape sequence ends: CSI sequences with a byte from @ to ~, others after one byte."""
    if data[start + 1 : start + 2] == b"[":
        for place in range(start + 2, len(data)):
            if 0x40 <= data[place] <= 0x7E:
                return place + 1
        return len(data)
    return min(len(data), start + (3 if data[start + 1 : start + 2] == b"O" else 2))


def _ignore_suspend(source: int) -> None:
    """Let Ctrl-Z be a key, as the shell would get the terminal back in the view's mode."""
    modes = termios.tcgetattr(source)
    modes[6][termios.VSUSP] = bytes([os.fpathconf(source, "PC_VDISABLE") & 0xFF])
    termios.tcsetattr(source, termios.TCSANOW, modes)


@contextmanager
def open_keyboard() -> Iterator[Keyboard]:
    """Read single keys from standard input if it is a terminal, and restore it however the block ends.

    Yields:
        The keyboard.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    former_wake = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    former_size = signal.signal(signal.SIGWINCH, lambda _number, _frame: None)
    source = sys.stdin.fileno() if sys.stdin is not None and sys.stdin.isatty() else None
    modes = None if source is None else termios.tcgetattr(source)
    try:
        if source is not None:
            tty.setcbreak(source, termios.TCSANOW)
            _ignore_suspend(source)
        yield Keyboard(source, reader)
    finally:
        if source is not None and modes is not None:
            termios.tcsetattr(source, termios.TCSANOW, modes)
        signal.signal(signal.SIGWINCH, former_size)
        signal.set_wakeup_fd(former_wake)
        os.close(reader)
        os.close(writer)

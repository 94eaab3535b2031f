"""The one way from the program to a terminal: text is written harmlessly, control sequences by name.

Text comes from modules, logs, people and other programs. A character of it that moves the cursor, clears the
screen, sets a title or reorders what is shown could make a terminal say what no program said. So `main` puts
a `SafeStream` in place of standard output and standard error, and all output goes through it.

In a terminal, text is wrapped at its width; files and other programs get each line whole. `print_data` writes
what a program may read, such as JSON, and wraps nothing anywhere.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import IO, Any, Final, Protocol

from aeros.cli.terminal.wrapping import COLOUR, wrap_line
from aeros.spec.diagnostics.characters import escape_hidden, find_hidden

_INNER_LINE: Final = re.compile(r"\n(?=[^\n])")
_USUAL_WIDTH: Final = 80
_LEAST_WIDTH: Final = 40


def escape_for_terminal(text: str) -> str:
    r"""Replace every character that a reader cannot see by an escape; lines and tabs stay.

    Args:
        text: any text.

    Returns:
        The text with escapes such as `\u001b`, which mean the same in JSON.
    """
    if find_hidden(text) is None and "\r" not in text:
        return text
    return "".join(escape_hidden(text, _escape))


def _escape(character: str) -> str:
    if character in "\n\t":
        return character
    units = character.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at]:02x}{units[at + 1]:02x}" for at in range(0, len(units), 2))


class SafeStream:
    """A text stream that writes no control character but line feed and tab, and wraps text in a terminal.

    All else is that of the stream behind it, so bytes written to its `buffer` are the caller's matter.

    Args:
        stream: the stream behind it.
        is_of_messages: each text is a message: what follows a line feed in it is indented, so that the text
            of others in it cannot pass for a message of its own.
    """

    def __init__(self, stream: IO[str], *, is_of_messages: bool = False) -> None:
        self._stream = stream
        self._is_of_messages = is_of_messages
        self._is_terminal = stream.isatty()
        self._column = 0

    def write(self, text: str) -> int:
        """Write text harmlessly; in a terminal, wrapped at its width.

        Args:
            text: any text.

        Returns:
            Number of characters of `text`.
        """
        shown = escape_for_terminal(text)
        if self._is_of_messages:
            start = len(shown) - len(shown.lstrip("\n"))
            shown = shown[:start] + _INNER_LINE.sub("\n  ", shown[start:])
        self._write(self._wrapped(shown))
        return len(text)

    def write_coloured(self, text: str) -> None:
        """Write text as `write` does, but leave colours as they are.

        Args:
            text: text of a renderer that escapes what it shows and then adds colours.
        """
        parts = COLOUR.split(text)
        parts[::2] = map(escape_for_terminal, parts[::2])
        self._write(self._wrapped("".join(parts)))

    def write_data(self, text: str) -> None:
        """Write text harmlessly and wrap nothing.

        Args:
            text: text that a program may read.
        """
        self._write(escape_for_terminal(text))

    def _write(self, text: str) -> None:
        with ExitStack() as stack:
            for one in _PROGRESS:
                stack.enter_context(one.lock)  # so that it is not drawn again before the text is written
                one.erase()
            stack.enter_context(self._named())
            self._stream.write(text)

    def _wrapped(self, text: str) -> str:
        """Break the lines that are wider than the terminal."""
        if not self._is_terminal or not text:
            return text
        width = screen_width(self._stream)
        lines = text.split("\n")
        for place, line in enumerate(lines):
            start = 0 if place else self._column
            if start + len(line) > width or not line.isascii():
                lines[place] = wrap_line(line, width, start)
        last = lines[-1].rpartition("\n")[2]
        self._column = len(last) + (0 if len(lines) > 1 or "\n" in lines[-1] else self._column)
        return "\n".join(lines)

    def flush(self) -> None:
        """Write what is buffered."""
        with self._named():
            self._stream.flush()

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Name the stream in the errors of writes, such as those of a disk that is full."""
        try:
            yield
        except OSError as error:
            name = "standard error" if self._is_of_messages else "standard output"
            error.filename = error.filename or name
            raise

    def writelines(self, lines: Iterator[str]) -> None:
        """Write each line harmlessly.

        Args:
            lines: any texts.
        """
        for line in lines:
            self.write(line)

    def write_control(self, sequence: str) -> None:
        """Write a control sequence of our own as it is.

        Args:
            sequence: of the program, without text from anywhere else that was not escaped.
        """
        self._stream.write(sequence)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._stream)


@contextmanager
def safe_streams() -> Iterator[None]:
    """Put safe streams in place of standard output and standard error, and take them back at the end."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        one if one is None or isinstance(one, SafeStream) else SafeStream(one, is_of_messages=is_of_messages)
        for one, is_of_messages in zip(before, (False, True), strict=True)
    )
    try:
        yield
    finally:
        end_progress()
        sys.stdout, sys.stderr = before


def write_control(sequence: str, stream: Any = None) -> None:
    """Write a control sequence of our own.

    Args:
        sequence: a constant of the program, without text from anywhere else.
        stream: the stream; None for standard output.
    """
    into = sys.stdout if stream is None else stream
    if isinstance(into, SafeStream):
        into.write_control(sequence)
    else:
        into.write(sequence)


def print_line(text: str) -> None:
    """Print text on one line of standard output, whatever is in it.

    Args:
        text: text with names, paths and words of others.
    """
    sys.stdout.write(escape_for_terminal(text).replace("\n", "\\n") + "\n")


def print_data(text: str, *, end: str = "\n", flush: bool = False) -> None:
    """Print text that a program may read, such as JSON, a diff or a script: no line of it is wrapped.

    Args:
        text: the text.
        end: written after it.
        flush: let a program that waits for it have it at once.
    """
    if isinstance(sys.stdout, SafeStream):
        sys.stdout.write_data(text + end)
    else:
        sys.stdout.write(text + end)
    if flush:
        sys.stdout.flush()


def print_coloured(text: str, stream: Any = None) -> None:
    """Print text in which only colours are left as they are.

    Args:
        text: text of a renderer that escapes what it shows and then adds colours.
        stream: the stream; None for standard output.
    """
    into = sys.stdout if stream is None else stream
    for line in text.split("\n"):
        if isinstance(into, SafeStream):
            into.write_coloured(f"{line}\n")
        else:
            into.write(f"{line}\n")


def screen_width(stream: IO[str] | None = None) -> int:
    """Measure a terminal.

    Args:
        stream: to the terminal; None for standard output.

    Returns:
        Its width in columns, at least 40: that of `COLUMNS` if it is set, 80 if nothing says it.
    """
    given = os.environ.get("COLUMNS", "")
    columns = int(given) if given.isascii() and given.isdigit() else 0
    if not columns:
        try:
            columns = os.get_terminal_size((stream or sys.stdout).fileno()).columns
        except (AttributeError, OSError, ValueError):  # no terminal, or a stream without a file
            columns = 0
    return max(_LEAST_WIDTH, columns or _USUAL_WIDTH)


def output_width(stream: IO[str] | None = None) -> int | None:
    """Return the columns into which tables and marked lines must fit.

    Args:
        stream: for which they are; None for standard output.

    Returns:
        The width of the terminal; None for a file or another program, whose lines are never wrapped.
    """
    into = stream or sys.stdout
    return screen_width(into) if into.isatty() else None


def shows_colour(stream: IO[str], choice: str = "auto") -> bool:
    """Say if text for a stream gets colours.

    `NO_COLOR` (https://no-color.org) and `FORCE_COLOR` (https://force-color.org) decide for every stream, the
    former first, where they are set and not empty; otherwise terminals get colours, but for those that are
    named `dumb`.

    Args:
        stream: standard output or standard error.
        choice: `always` or `never`, whatever the environment says; `auto` for the above.

    Returns:
        True if it gets colours.
    """
    if choice != "auto":
        return choice == "always"
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (stream.isatty() and os.environ.get("TERM") != "dumb")


class ShownProgress(Protocol):
    """Progress that stands on the last lines of a terminal.

    Attributes:
        lock: held while something is written, and while the progress is drawn, by a thread of its own.
    """

    lock: AbstractContextManager[object]

    def erase(self) -> None:
        """Erase it before something else is written; it may be shown again."""

    def end(self) -> None:
        """Erase it for good."""


_PROGRESS: Final[list[ShownProgress]] = []
"""The progress that is under way; empty if there is none."""

# A forked process has a copy of it, whose lock another thread may have held; its terminal is the parent's.
os.register_at_fork(after_in_child=_PROGRESS.clear)


def begin_progress(shown: ShownProgress) -> None:
    """Let progress be erased before anything else is written.

    Args:
        shown: the progress.
    """
    end_progress()
    _PROGRESS.append(shown)


def end_progress() -> None:
    """Erase the progress that is shown, if any is, for good."""
    while _PROGRESS:
        _PROGRESS.pop().end()

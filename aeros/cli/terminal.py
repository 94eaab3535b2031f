"""The one way from the program to a terminal: text is written harmlessly, control sequences by name.

Text comes from modules, logs, people and other programs. A character of it that moves the cursor, clears the
screen, sets a title or reorders what is shown could make a terminal say what no program said. So `main` puts
a `SafeStream` in place of standard output and standard error, and all output goes through it.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any, Final

from aeros.spec.diagnostics.characters import escape_hidden, find_hidden

_INNER_LINE: Final = re.compile(r"\n(?=[^\n])")
_ERASE_LINE: Final = "\r\x1b[K"
_COLOUR: Final = re.compile(r"(\x1b\[[0-9;]*m)")  # SGR sequences: colours and boldness


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
    """A text stream that writes no control character but line feed and tab.

    All else is that of the stream behind it, so bytes written to its `buffer` are the caller's matter.

    Args:
        stream: the stream behind it.
        is_of_messages: each text is a message: what follows a line feed in it is indented, so that the text
            of others in it cannot pass for a message of its own.
    """

    def __init__(self, stream: IO[str], *, is_of_messages: bool = False) -> None:
        self._stream = stream
        self._is_of_messages = is_of_messages

    def write(self, text: str) -> int:
        """Write text harmlessly.

        Args:
            text: any text.

        Returns:
            Number of characters of `text`.
        """
        clear_progress()
        shown = escape_for_terminal(text)
        if self._is_of_messages:
            start = len(shown) - len(shown.lstrip("\n"))
            shown = shown[:start] + _INNER_LINE.sub("\n  ", shown[start:])
        with self._named():
            self._stream.write(shown)
        return len(text)

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
            sequence: a constant of the program, without text from anywhere else.
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


def print_diagnostics(text: str) -> None:
    """Print rendered diagnostics to standard error; what a renderer shows it has escaped.

    Args:
        text: lines of text.
    """
    for line in text.split("\n"):
        sys.stderr.write(f"{line}\n")


def print_coloured(text: str) -> None:
    """Print text in which only colours are left as they are.

    Args:
        text: text of a renderer that escapes what it shows and then adds colours.
    """
    for part in _COLOUR.split(text):
        if _COLOUR.fullmatch(part):
            write_control(part)
        else:
            sys.stdout.write(part)
    sys.stdout.write("\n")


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


_ERASERS: Final[list[IO[str]]] = []
"""The stream on whose last line progress stands; empty if there is none."""


def clear_progress() -> None:
    """Erase the progress that is shown, if any is, before something else is written."""
    while _ERASERS:
        write_control(_ERASE_LINE, _ERASERS.pop())


def show_progress(text: str, *, is_last: bool = False) -> None:
    """Show progress on one line of standard error, in place of what was shown there before.

    Args:
        text: what is under way.
        is_last: leave the line standing.
    """
    write_control(_ERASE_LINE, sys.stderr)
    sys.stderr.write(escape_for_terminal(text).replace("\n", " "))
    write_control("\n" if is_last else "\r", sys.stderr)
    sys.stderr.flush()
    if not is_last:
        _ERASERS.append(sys.stderr)

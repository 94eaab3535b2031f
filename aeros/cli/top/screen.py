"""Screen of `aeros top`: coloured lines that fit the terminal, scrolling, keys, and questions before a stop.

It reads and writes nothing: keys go in by name, text comes out.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Final, NamedTuple

from rich.cells import cell_len, set_cell_size

from aeros.cli.terminal.streams import escape_for_terminal

_HOME, _END_OF_LINE, _BELOW, _PLAIN = "\x1b[H", "\x1b[K", "\x1b[J", "\x1b[0m"

_KEYS: Final = "q quit   p pause   s stop   arrows scroll"
_QUESTION: Final = "stop all motion and end the run?  y: yes   any other key: no"


class Style(Enum):
    """Meaning of a line that its colour shows; the text says the same without colours."""

    NORMAL = ""
    TITLE = "\x1b[1m"
    GOOD = "\x1b[32m"
    WARNING = "\x1b[33m"
    BAD = "\x1b[1;31m"
    KEYS = "\x1b[7m"


class StyledLine(NamedTuple):
    """A line of the view.

    Attributes:
        text: the text, without control characters of its own.
        style: its meaning.
    """

    text: str
    style: Style = Style.NORMAL


class ScreenAction(Enum):
    """Action that a key asks for."""

    QUIT = "quit"
    PAUSE = "pause"
    STOP = "stop"


class TopScreen:
    """The screen.

    Args:
        has_keys: True if keys can be pressed.
        has_colours: True to show colours.
    """

    def __init__(self, *, has_keys: bool, has_colours: bool) -> None:
        self._has_keys, self._has_colours = has_keys, has_colours
        self._first = 0
        self._count = 0
        self._height = 1
        self._is_asking = False
        self._message = ""

    def set_message(self, text: str) -> None:
        """Show text below the view, in place of the keys, until the next key; any thread may call this.

        Args:
            text: the text.
        """
        self._message = text

    def press(self, key: str) -> ScreenAction | None:
        """Take a key.

        Args:
            key: its name, or the character.

        Returns:
            The action that it asks for; None if it changes the screen alone.
        """
        if self._is_asking:
            self._is_asking = False
            self._message = "" if key == "y" else "not stopped"
            return ScreenAction.STOP if key == "y" else None
        self._message = ""
        match key:
            case "q":
                return ScreenAction.QUIT
            case "p":
                return ScreenAction.PAUSE
            case "s":
                self._is_asking = True
            case "up" | "k":
                self._first -= 1
            case "down" | "j":
                self._first += 1
            case "page up":
                self._first -= self._height
            case "page down" | " ":
                self._first += self._height
            case "home":
                self._first = 0
            case "end":
                self._first = self._count
        return None

    def render(self, lines: Sequence[StyledLine], columns: int, rows: int) -> str:
        """Render the view for a terminal.

        Args:
            lines: all lines of the view.
            columns: width of the terminal.
            rows: its height.

        Returns:
            Text with control sequences that replaces what the terminal shows.
        """
        self._count = len(lines)
        self._height = max(1, rows - 2)
        self._first = max(0, min(self._first, self._count - self._height))
        shown = lines[self._first : self._first + self._height]
        texts = [self._line(one, columns) for one in shown]
        if rows >= 2:
            # The last line of the terminal stays put, as a line feed there would scroll.
            texts += [_END_OF_LINE] * (self._height - len(shown))
            texts.append(self._line(self._footer(), columns))
        return _HOME + "\n".join(texts) + _BELOW

    def _footer(self) -> StyledLine:
        if self._is_asking:
            return StyledLine(_QUESTION, Style.BAD)
        if self._message:
            return StyledLine(self._message, Style.WARNING)
        below = self._count - self._first - self._height
        hidden = [f"{n} more {where}" for n, where in ((self._first, "above"), (below, "below")) if n > 0]
        keys = [_KEYS if self._has_keys else "Ctrl-C quits"]
        return StyledLine("   ".join([*keys, *hidden]), Style.KEYS)

    def _line(self, line: StyledLine, columns: int) -> str:
        text = escape_for_terminal(line.text).replace("\n", "\\n").replace("\t", " ")
        room = max(0, columns - 1)
        cut = set_cell_size(text, room) if cell_len(text) > room else text
        if not self._has_colours or line.style is Style.NORMAL:
            return cut + _END_OF_LINE
        return f"{line.style.value}{cut}{_PLAIN}{_END_OF_LINE}"

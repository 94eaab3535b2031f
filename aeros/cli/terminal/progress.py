"""Progress on standard error, drawn by rich: shown after two seconds, erased before anything is written."""

from __future__ import annotations

import os
import sys
import threading
import time
from contextlib import AbstractContextManager
from typing import IO, TYPE_CHECKING, Final, TextIO, cast

from aeros.cli.terminal.streams import (
    begin_progress,
    escape_for_terminal,
    screen_width,
    shows_colour,
    write_control,
)

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_DELAY_S: Final = 2.0
"""Seconds of work before its progress is shown."""

_LOCK: Final = threading.RLock()

_STYLES: Final = {"bar.back": "dim", "bar.complete": "green", "bar.finished": "green"}
_STYLES.update(dict.fromkeys(("progress.elapsed", "progress.remaining", "progress.download"), "none"))


class ProgressLine:
    """Progress of a command, on the last line of the terminal of standard error.

    Nothing is shown where standard error is no terminal, or one without control sequences.

    Args:
        total: number of parts of the work; None if it is not known.
        delay: seconds before anything is shown.

    Attributes:
        lock: held while something is written to a terminal, and while this is drawn.
    """

    lock: AbstractContextManager[object]

    def __init__(self, total: int | None = None, *, delay: float = _DELAY_S) -> None:
        self.lock = _LOCK
        self._total = total
        self._text = ""
        self._done = 0
        self._is_shown = sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
        self._start_time = time.monotonic()
        self._delay = delay
        self._drawn: tuple[Progress, TaskID] | None = None
        self._timer: threading.Timer | None = None
        if self._is_shown:
            begin_progress(self)
            # A thread, as the work may be one long call; it does not keep the program alive.
            self._timer = threading.Timer(delay, self._draw)
            self._timer.daemon = True
            self._timer.start()

    def show(self, text: str, done: int = 0) -> None:
        """Show what is under way, in place of what was shown before.

        Args:
            text: what is under way.
            done: number of parts that are done.
        """
        with self.lock:
            self._text = escape_for_terminal(text).replace("\n", " ")
            self._done = done
            if time.monotonic() - self._start_time >= self._delay:
                self._draw()

    def erase(self) -> None:
        """Erase it; the next `show` shows it again."""
        with self.lock:
            if self._drawn is not None:
                drawn, self._drawn = self._drawn[0], None
                drawn.stop()

    def end(self) -> None:
        """Erase it for good; safe to call twice."""
        with self.lock:
            self._is_shown = False
            if self._timer is not None:
                self._timer.cancel()
            self.erase()

    def _draw(self) -> None:
        with self.lock:
            if not self._is_shown or not self._text:
                return
            if self._drawn is None:
                self._drawn = _start(self._text, self._done, self._total, self._start_time)
            progress, task = self._drawn
            progress.update(task, description=self._text, completed=self._done)


def _start(text: str, done: int, total: int | None, start_time: float) -> tuple[Progress, TaskID]:
    """Begin to draw on the last line of the terminal."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.theme import Theme

    class VisibleCursorConsole(Console):
        """A console that never hides the cursor, as a program that is killed could not show it again."""

        def show_cursor(self, show: bool = True) -> bool:
            return False

    console = VisibleCursorConsole(
        file=cast("IO[str]", _ErrorTerminal(sys.stderr)),  # all of a stream that rich uses
        force_terminal=True,
        color_system="standard" if shows_colour(sys.stderr) else None,
        width=screen_width(sys.stderr),
        legacy_windows=False,
        theme=Theme(_STYLES),
        _environ={},
    )
    columns: list[ProgressColumn] = [TextColumn("{task.description}", markup=False)]
    if total is None:
        columns.append(TimeElapsedColumn())
    else:
        columns += [BarColumn(24), MofNCompleteColumn(), TimeRemainingColumn()]
    progress = Progress(
        *columns,
        console=console,
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
        refresh_per_second=4,
        get_time=time.monotonic,
    )
    task = progress.add_task(text, total=total, completed=done)
    progress.tasks[0].start_time = start_time
    progress.start()
    return progress, task


class _ErrorTerminal:
    """Standard error for rich, whose control sequences are written as they are.

    Args:
        stream: standard error.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.encoding = stream.encoding

    def write(self, text: str) -> int:
        write_control(text, self._stream)
        return len(text)

    def flush(self) -> None:
        self._stream.flush()

    def isatty(self) -> bool:
        return True

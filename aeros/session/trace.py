"""Write the agent's events to a file, and print them as they happen."""

from __future__ import annotations

import json
import re
from collections import deque
from pathlib import Path
from typing import Final, Self, TextIO

from aeros.agent.execution.journal import AgentEvent
from aeros.files import open_private
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.migrations import formats

TRACE: Final = "trace.jsonl"
"""File name of the trace in the folder of a run."""


_LONGEST_ROUND: Final = 6
"""Lines of a round that is folded if it repeats, at most: plan, step and wait are three."""


_MEASURED: Final = re.compile(r"\d+\.\d+")
"""A number as of measurements, which differs a little each time; whole numbers count and name things."""


class _RoundFolder:
    """Finds lines that only repeat the lines before but for measured numbers, in rounds of a few lines.

    A round is shown twice; from then on its lines are counted.
    """

    def __init__(self) -> None:
        self._texts: deque[str] = deque(maxlen=2 * _LONGEST_ROUND)
        self._length = 0
        self._folded = 0

    def is_repeated(self, text: str) -> bool:
        """Check if a line need not be shown, and count it if so.

        Args:
            text: The line, without its time.

        Returns:
            True if it only repeats the lines before.
        """
        plain = _MEASURED.sub("#", text)
        if not self._length or plain != self._texts[-self._length]:
            return False
        self._texts.append(plain)
        self._folded += 1
        return True

    def end_round(self) -> str:
        """Forget the round that repeats.

        Returns:
            A line for what was not shown of it; empty if all was.
        """
        count, length = self._folded, self._length
        self._folded = self._length = 0
        if not count:
            return ""
        lines = "the line above" if length == 1 else f"the {length} lines above"
        times, rest = divmod(count, length)
        more = f", and {rest} of them once more" if rest else ""
        return f"{lines} repeated {times} more time{'' if times == 1 else 's'}{more}"

    def add(self, text: str) -> None:
        """Take in a line that is shown.

        Args:
            text: The line, without its time.
        """
        self._texts.append(_MEASURED.sub("#", text))
        listed = list(self._texts)
        rounds = range(1, len(listed) // 2 + 1)
        self._length = next((n for n in rounds if listed[-n:] == listed[-2 * n : -n]), 0)


class TraceWriter:
    """Writer of each event of the agent as one line of JSON, appended to a file.

    Args:
        path: The file, created for its owner alone if it does not exist.
        stream: Stream on which each event is printed as a line of text, repetitions with their number alone;
            None to print nothing.
    """

    def __init__(self, path: Path, stream: TextIO | None) -> None:
        self._file = open_private(path)
        self._stream = stream
        self._rounds = _RoundFolder()
        self._time = 0.0

    def write(self, event: AgentEvent) -> None:
        """Write and print one event.

        Args:
            event: The event.

        Raises:
            OSError: The file cannot be written.  A stream that fails is not written to again.
        """
        line = {
            "schema": formats.TRACE.schema,
            "time": event.time,
            "kind": event.kind,
            "text": event.text,
            "details": event.details,
        }
        self._file.write((json.dumps(line, default=str) + "\n").encode("ascii"))
        if event.text:
            self._show(event)

    def close(self) -> None:
        """Close the file; safe to call twice."""
        self._print(self._time, self._rounds.end_round())
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _show(self, event: AgentEvent) -> None:
        if not self._rounds.is_repeated(event.text):
            self._print(self._time, self._rounds.end_round())
            self._rounds.add(event.text)
            self._print(event.time, event.text)
        self._time = event.time

    def _print(self, time: float, text: str) -> None:
        if self._stream is not None and text:
            try:
                print(f"{time:7.2f} s  {escape_invisible(text)}", file=self._stream, flush=True)
            except OSError:
                self._stream = None

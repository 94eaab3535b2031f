"""Write the agent's events to a file, and print them as they happen."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final, Self, TextIO

from aeros.agent.execution.journal import AgentEvent
from aeros.files import open_private
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.migrations import formats

TRACE: Final = "trace.jsonl"
"""File name of the trace in the folder of a run."""


class TraceWriter:
    """Writer of each event of the agent as one line of JSON, appended to a file.

    Args:
        path: The file, created for its owner alone if it does not exist.
        stream: Stream on which each event is printed as a line of text; None to print nothing.
    """

    def __init__(self, path: Path, stream: TextIO | None) -> None:
        self._file = open_private(path)
        self._stream = stream

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
        if self._stream is not None and event.text:
            try:
                print(f"{event.time:7.2f} s  {escape_invisible(event.text)}", file=self._stream, flush=True)
            except OSError:
                self._stream = None

    def close(self) -> None:
        """Close the file; safe to call twice."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

from __future__ import annotations

import io
import json
from pathlib import Path

from aeros.agent.execution.journal import AgentEvent
from aeros.session.trace import TraceWriter

_OUTPUT = AgentEvent("plan-accepted", "two steps", {"steps": 2}, 1.5)
_SILENT = AgentEvent("lifecycle", "", {"after": "running"}, 2.0)


class Broken(io.StringIO):
    """A terminal that went away."""

    def write(self, _: str) -> int:
        raise BrokenPipeError


def test_each_event_is_a_line_of_json_and_those_with_text_are_printed(tmp_path: Path) -> None:
    stream = io.StringIO()
    with TraceWriter(tmp_path / "trace.jsonl", stream) as trace:
        trace.write(_OUTPUT)
        trace.write(_SILENT)
    lines = [json.loads(line) for line in (tmp_path / "trace.jsonl").read_text().splitlines()]
    assert lines[0] == {
        "time": 1.5,
        "kind": "plan-accepted",
        "text": "two steps",
        "details": {"steps": 2},
        "schema": "aeros/trace/2",
    }
    assert [line["kind"] for line in lines] == ["plan-accepted", "lifecycle"]
    assert stream.getvalue() == "   1.50 s  two steps\n"


def test_a_file_that_is_there_is_continued(tmp_path: Path) -> None:
    for _ in range(2):
        with TraceWriter(tmp_path / "trace.jsonl", None) as trace:
            trace.write(_OUTPUT)
    assert len((tmp_path / "trace.jsonl").read_text().splitlines()) == 2


def test_a_stream_that_went_away_stops_nothing(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "trace.jsonl", Broken()) as trace:
        trace.write(_OUTPUT)
        trace.write(_OUTPUT)
    assert len((tmp_path / "trace.jsonl").read_text().splitlines()) == 2

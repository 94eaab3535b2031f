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


def printed(tmp_path: Path, *texts: str) -> list[str]:
    stream = io.StringIO()
    with TraceWriter(tmp_path / "trace.jsonl", stream) as trace:
        for number, text in enumerate(texts):
            trace.write(AgentEvent("note", text, {}, float(number)))
    assert len((tmp_path / "trace.jsonl").read_text().splitlines()) == len(texts)  # all are in the file
    return [line.partition("s  ")[2] for line in stream.getvalue().splitlines()]


def test_rounds_of_the_same_lines_are_printed_twice_and_then_counted(tmp_path: Path) -> None:
    around = ["plan", "step not started", "waits"]
    assert printed(tmp_path, "begin", *around * 60, "end") == [
        "begin",
        *around * 2,
        "the 3 lines above repeated 58 more times",
        "end",
    ]


def test_measured_numbers_make_no_round_different_and_names_and_counts_do(tmp_path: Path) -> None:
    rounds = [("step", f"denied at 0.{number} m (at least 0.9 m)") for number in (41, 5, 38, 44)]
    assert printed(tmp_path, *(line for one in rounds for line in one)) == [
        *rounds[0],
        *rounds[1],
        "the 2 lines above repeated 2 more times",
    ]
    (tmp_path / "trace.jsonl").unlink()
    counted = ["re-plan 1", "re-plan 2", "re-plan 3", "cup_1", "cup_2", "cup_3"]
    assert printed(tmp_path, *counted) == counted


def test_a_round_that_breaks_off_is_counted_to_its_last_line(tmp_path: Path) -> None:
    assert printed(tmp_path, *["a", "b"] * 3, "a") == [
        "a",
        "b",
        "a",
        "b",
        "the 2 lines above repeated 1 more time, and 1 of them once more",
    ]


def test_one_line_that_repeats_is_counted_and_other_lines_are_all_printed(tmp_path: Path) -> None:
    assert printed(tmp_path, "a", "a", "a", "b") == ["a", "a", "the line above repeated 1 more time", "b"]
    (tmp_path / "trace.jsonl").unlink()
    different = ["a", "b", "a", "c", "a", "b"]
    assert printed(tmp_path, *different) == different

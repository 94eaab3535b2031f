"""What a run writes and prints: one line for each event, and a summary whose numbers are the report's."""

from __future__ import annotations

import io
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.agent.journal import Event
from aeros.agent.report import RunReport
from aeros.cli.run_report import TraceWriter, summary

EVENTS = (
    Event("plan", "first \x1b[2J", {"steps": ["a.b"]}, 1.25),
    Event("observed", "", {"path": Path("x")}, 2.0),
    Event("run-ended", "goal reached", {}, 3.5),
)


class Gone(io.StringIO):
    """A terminal that was closed."""

    def write(self, text: str, /) -> int:
        raise BrokenPipeError


def test_each_event_is_a_line_of_the_file_and_those_with_text_are_printed(tmp_path: Path) -> None:
    shown, path = io.StringIO(), tmp_path / "trace.jsonl"
    path.write_text('"before"\n')
    with TraceWriter(path, shown) as trace:
        for number, event in enumerate(EVENTS, 1):
            trace.tell(event)
            # Whoever follows the file sees each line at once.
            assert len(path.read_text().splitlines()) == number + 1
    before, *lines = (json.loads(line) for line in path.read_text().splitlines())
    assert before == "before"
    assert [(one["time"], one["kind"], one["text"]) for one in lines] == [
        (event.time, event.kind, event.text) for event in EVENTS
    ]
    assert [one["details"] for one in lines] == [{"steps": ["a.b"]}, {"path": "x"}, {}]
    assert shown.getvalue() == "   1.25 s  first \\x1b[2J\n   3.50 s  goal reached\n"
    with pytest.raises(ValueError, match="closed file"):
        trace.tell(EVENTS[0])


def test_events_are_printed_to_standard_output_by_default(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with TraceWriter(tmp_path / "trace.jsonl") as trace:
        trace.tell(EVENTS[2])
    assert capsys.readouterr().out == "   3.50 s  goal reached\n"


def test_a_closed_terminal_stops_no_run(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    with TraceWriter(path, Gone()) as trace:
        for event in EVENTS:
            trace.tell(event)
    assert len(path.read_text().splitlines()) == len(EVENTS)


def report(**changed: Any) -> RunReport:
    steps = [SimpleNamespace(role=None, allowed=5, attenuated=2, denied=1)] * 3
    given: dict[str, Any] = {
        "instruction": "x", "module": "m", "task": "t", "goal": "a and b", "reached": True,
        "measured": {"a": True, "b": None}, "steps": tuple(steps), "replans": 4, "reason": None, **changed,
    }  # fmt: skip
    return RunReport(**given)


def test_the_summary_holds_the_numbers_of_the_report() -> None:
    modules = [SimpleNamespace(obligation_count=20, guarded_count=3)] * 2
    proof = cast("Any", SimpleNamespace(modules=modules))
    said = summary(proof, report(), "symbolic", 12.34, 5.67)
    assert said.splitlines() == [
        "",
        "m.t: goal reached",
        "goal       a and b; measured on the symbolic plant: a = true, b = unknown",
        "modules    2 proved, 40 obligations, 6 left to the gate",
        "steps      3 run, 0 retries, 0 recoveries, 4 re-plans",
        "decisions  15 allowed, 6 attenuated, 3 denied",
        "time       12.3 s simulated, 5.7 s real",
    ]
    missed = summary(proof, report(reached=False, reason="why"), "symbolic", 0.0, 0.0)
    assert "m.t: goal not reached: why" in missed

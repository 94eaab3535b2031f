"""A run that goes on is followed by what it writes, whole lines at a time and whatever they say."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from aeros.apps.run_follower import RunFollower
from aeros.cli.top.top import run_view
from aeros.runtime.audit.log import verify_log
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.apps.report_page.left_runs import copied_run, decision, old_run


class Writing:
    """A folder to which a run writes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._count = 0

    def record(self, kind: str, /, **details: Any) -> None:
        line = {"event": kind, "details": details, "sequence": self._count, "previous": "", "written": 0.0}
        self._count += 1
        self.write("audit.jsonl", json.dumps(line) + "\n")

    def emit(self, time: float, kind: str, text: str, **details: Any) -> None:
        line = {"time": time, "kind": kind, "text": text, "details": details}
        self.write("trace.jsonl", json.dumps(line) + "\n")

    def write(self, name: str, text: str) -> None:
        with (self.folder / name).open("a") as file:
            file.write(text)


@pytest.fixture
def writing(tmp_path: Path) -> Writing:
    return Writing(tmp_path)


def test_a_run_with_old_event_names_is_followed(tmp_path: Path) -> None:
    run = RunFollower(old_run(tmp_path / "old"))
    run.read()
    view = run_view(run, None, is_there=True)
    assert view["instruction"] == "make dumplings"
    assert view["ended"] == {"reached": True, "reason": None, "skipped": None}
    assert run.plan is not None


def test_a_missing_file_is_waited_for(writing: Writing) -> None:
    run = RunFollower(writing.folder)
    run.read()
    assert run.now == 0.0
    writing.record("decision", **decision(1.5))
    run.read()
    assert (run.now, run.counts["ALLOW"]) == (1.5, 1)
    run.read()
    assert run.counts["ALLOW"] == 1


def test_half_a_line_is_not_read(writing: Writing) -> None:
    run = RunFollower(writing.folder)
    line = json.dumps({"time": 2.0, "state": {"human_distance": [1.0, 2.0]}})
    writing.write("measured.jsonl", line[:20])
    run.read()
    assert run.world == {}
    writing.write("measured.jsonl", line[20:] + "\n")
    run.read()
    assert run.world == {"human_distance": (1.0, 2.0)}


def test_of_two_measurements_the_later_one_is_held(writing: Writing) -> None:
    run = RunFollower(writing.folder)
    for time, at, value in ((2.0, 2.0, 1.0), (2.1, 1.9, 5.0)):
        writing.write("measured.jsonl", json.dumps({"time": time, "state": {"x": [value, at]}}) + "\n")
    run.read()
    assert run.world == {"x": (1.0, 2.0)}
    assert run_view(run, None, is_there=True)["world"]["x"]["age"] == pytest.approx(0.1)


def test_the_plan_shows_where_it_is(writing: Writing) -> None:
    run = RunFollower(writing.folder)

    def shown() -> list[str]:
        run.read()
        return [part["how"] for part in run_view(run, None, is_there=True)["plan"]]

    writing.emit(0.0, "plan-accepted", "a → b", steps=["m.a", "m.b (retry 2, on_failure c)", "m.c"])
    assert shown() == ["to come"] * 3
    writing.record("step-began", module="m", skill="a", time=0.0)
    assert shown() == ["under way", "to come", "to come"]
    writing.record("step-ended", module="m", skill="a", time=1.0, status="finished", reason="")
    writing.record("note", event="step-ended", details={"skill": "m.a", "outcome": "ok", "failed": False})
    writing.record("step-began", module="m", skill="b", time=1.0)
    writing.record("step-ended", module="m", skill="b", time=2.0, status="denied", reason="no")
    writing.record("note", event="step-ended", details={"skill": "m.b", "outcome": None, "failed": True})
    assert shown() == ["done", "failed", "to come"]
    writing.emit(3.0, "plan-accepted", "b", steps=["m.b", "m.c"])
    assert shown() == ["to come", "to come"]


@pytest.mark.parametrize("end", ["run-ended", "run-already-ended"])
def test_a_run_after_a_run_begins_anew(end: str, writing: Writing) -> None:
    run = RunFollower(writing.folder)
    writing.record("note", event="task-selected", details={"instruction": "one", "task": "m.t"})
    writing.record("note", event=end, details={"reached": True})
    run.read()
    assert run.ended == {"reached": True}
    assert not run_view(run, None, is_there=True)["is_running"]
    writing.record("note", event="task-selected", details={"instruction": "two", "task": "m.t"})
    run.read()
    view = run_view(run, None, is_there=True)
    assert (view["ended"], view["instruction"]) == (None, "two")


@pytest.mark.parametrize("odd", [None, 1, "x", [], {}, [[1, 2, 3]], {"a": [1]}, 1e999])
def test_lines_of_another_form_are_passed_over(odd: object, writing: Writing) -> None:
    run = RunFollower(writing.folder)
    for name in ("audit.jsonl", "trace.jsonl", "measured.jsonl"):
        writing.write(name, json.dumps(odd) + "\n[[[\n\x00\n")
    for event in ("decision", "step-began", "step-ended", "note", "session-opened", "paused"):
        writing.record(event, time=odd, verdict=odd, asked=odd, state=odd, usage=odd, event=odd, details=odd)
    writing.record("decision", verdict="ALLOW", state={"x": odd}, usage=odd, reasons=odd)
    writing.emit(0.0, "plan-accepted", "x", steps=odd)
    run.read()
    view = run_view(run, None, is_there=False)
    json.dumps(view)
    # Of all these lines one decision has the form of one, and neither began or ended anything.
    assert run.counts["ALLOW"] == 1
    assert (view["ended"], view["instruction"]) == (None, None)


def test_memory_does_not_grow_with_the_run(writing: Writing) -> None:
    run = RunFollower(writing.folder)
    for number in range(500):
        writing.record("decision", **decision(float(number)))
        writing.record("note", event="wait-started", details={})
        writing.emit(float(number), "wait-started", "x")
    run.read()
    assert run.counts["ALLOW"] == 500
    assert (len(run.last), len(run.events)) == (50, 50)


def test_a_motion_under_way_is_held_against_its_bounds(tmp_path: Path) -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    writing = Writing(tmp_path)
    writing.record(
        "session-opened", configuration="c", site={"id": site.id, "digest": site.digest}, modules={}
    )
    writing.record("step-began", module="arm", skill="reach", time=0.0)
    action = {"kind": "move_tool", "parameters": {"target": [0.5, 0, 0.3], "yaw": 0.0, "speed": 0.1}}
    state = {"human_distance": [3.0, 1.0]}
    writing.record("decision", **decision(1.0, asked=action, decided=action, state=state))
    writing.write("measured.jsonl", json.dumps({"time": 2.0, "state": {"human_distance": [0.8, 2.0]}}) + "\n")
    run = RunFollower(tmp_path)
    run.read()
    assert run.site == site.digest
    bounds = {one["rule"]: one for one in run_view(run, site, is_there=True)["bounds"]}
    assert bounds["arm-separation"]["measured"] == 0.8
    assert bounds["arm-separation"]["margin"] < 0
    writing.record("step-ended", module="arm", skill="reach", time=2.1, status="stopped", reason="")
    run.read()
    assert run.closest_bounds(site) == []


def test_a_finished_run_is_seen_whole(tmp_path: Path) -> None:
    out = copied_run(tmp_path)
    run = RunFollower(out)
    run.read()
    assert run.ended is not None
    assert run.ended["reached"] is True
    assert run.counts["ALLOW"] == verify_log(out / "audit.jsonl").decisions.allowed > 100
    assert run.last[-1].usage.keys() == {"grip-rate"}


def test_the_use_of_resources_and_the_calls_of_tools_are_followed(tmp_path: Path) -> None:
    writing = Writing(tmp_path)
    for used in (1, 2):
        line = {"time": float(used), "state": {}, "modules": {"polish": {"processes": used}}}
        writing.write(
            "measured.jsonl", json.dumps(line) + "\n" + json.dumps({"time": 3.0, "state": {}}) + "\n"
        )
    writing.record("tool-answered", tool="ask", time=1.0, answer={})
    writing.record("tool-failed", tool="ask", time=2.0, reason="it did not answer", unknown=[])
    writing.record("tool-answered", tool=7, time=1.0, answer={})
    run = RunFollower(tmp_path)
    run.read()
    assert run.modules == {"polish": {"processes": 2}}
    assert run.tool_calls == {"ask": (2, 1)}
    view = run_view(run, None, is_there=True)
    assert view["modules"] == {"polish": {"processes": 2}}
    assert view["tools"] == {"ask": {"calls": 2, "failed": 1, "timeout": None, "quotas": {}}}

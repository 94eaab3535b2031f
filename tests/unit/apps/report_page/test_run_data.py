"""Files of a run are read as far as they have the form that AEROS writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from aeros.apps.report_page.page import page_of
from aeros.apps.report_page.run_data import SkillExecution, read_run_data
from aeros.spec.migrations.renamed_names import trace_to_2
from tests.unit.apps.report_page.left_runs import copied_run, decision, old_run, written_run


def test_steps_are_reported_with_role_and_outcome(tmp_path: Path) -> None:
    left = read_run_data(copied_run(tmp_path))
    assert [(run.skill.partition(".")[2], run.role, run.result_text, run.failed) for run in left.runs] == [
        ("prepare", "step", "missed", True),
        ("prepare", "step", "laid_out", False),
        ("wrap", "step", "spoilt", True),
        ("recover", "recovery", "aligned", False),
        ("wrap", "step", "wrapped", False),
        ("boil", "step", "cooked", False),
    ]
    assert left.runs[0].previous is None
    assert [run.previous for run in left.runs[1:]] == left.runs[:-1]
    assert left.problems == []
    assert left.samples
    assert left.samples == sorted(left.samples, key=lambda sample: sample[0])


def test_a_run_with_old_event_names_is_read_as_one_with_current_names(tmp_path: Path) -> None:
    old = read_run_data(old_run(tmp_path / "old"))
    assert old.problems == []
    assert old.chain is not None
    assert old.chain.is_sound
    kinds = [event.kind for event in old.events]
    assert kinds[:3] == ["task-selected", "lifecycle", "plan-accepted"]
    assert {"replan", "step-skipped"} <= set(kinds)
    assert [kind for kind, _ in old.notes] == kinds
    assert "make_dumplings.make_dumplings" in page_of(old, "old", {}, "")


def test_a_trace_that_two_versions_wrote_is_read(tmp_path: Path) -> None:
    out = old_run(tmp_path / "old")
    lines = (out / "trace.jsonl").read_text().splitlines(keepends=True)
    rest = trace_to_2("".join(lines[5:]))
    (out / "trace.jsonl").write_text("".join(lines[:5]) + rest)
    assert read_run_data(out).problems == []
    (out / "trace.jsonl").write_text("".join(lines[:5]) + rest.replace("trace/2", "trace/3"))
    (newer, _) = read_run_data(out).problems
    assert "was written by a newer AEROS" in newer


def test_a_trace_that_says_other_things_than_the_record_is_noticed(tmp_path: Path) -> None:
    out = copied_run(tmp_path)
    trace = out / "trace.jsonl"
    trace.write_text(trace.read_text().replace('"missed"', '"laid_out"'))
    assert read_run_data(out).problems == ["trace.jsonl disagrees with the audit log"]


def test_a_fault_that_the_plant_reported_is_no_contradiction(tmp_path: Path) -> None:
    out = copied_run(tmp_path)
    fault = {"time": 1.0, "kind": "fault-started", "text": "slips", "details": {}}
    trace = out / "trace.jsonl"
    trace.write_text(json.dumps(fault) + "\n" + trace.read_text())
    left = read_run_data(out)
    assert left.problems == []
    assert left.events[0].text == "slips"


def test_without_trace_and_samples_the_record_is_enough(tmp_path: Path) -> None:
    out = copied_run(tmp_path)
    (out / "trace.jsonl").unlink()
    (out / "measured.jsonl").unlink()
    left = read_run_data(out)
    assert len(left.runs) == 6
    assert left.problems == [
        "trace.jsonl cannot be read: No such file or directory",
        "measured.jsonl cannot be read: No such file or directory",
    ]
    assert "The run has no samples" in page_of(left, "r", {}, "")


def test_a_skill_that_did_not_come_to_its_own_end_is_reported_by_how_it_ended() -> None:
    run = SkillExecution("a.b", 0.0, None, 1.0, "denied", "no", "step", "missed", True)
    assert run.result_text == "denied"
    run.status = "finished"
    assert run.result_text == "missed"


ODD: list[Any] = [None, 3, "x", [], {}, [[1, 2, 3]], {"a": [None]}, 1e999, True]


@pytest.mark.parametrize("odd", ODD)
def test_details_of_another_form_are_passed_over(odd: object, tmp_path: Path) -> None:
    names = ("reasons", "decided", "time", "state", "module", "skill", "asked", "configuration")
    records: list[tuple[str, dict[str, Any]]] = [("decision", decision(1.0) | {name: odd}) for name in names]
    for event in (
        "step-began",
        "step-ended",
        "step-broken",
        "stopped",
        "paused",
        "configuration-changed",
        "note",
    ):
        records += [
            (event, {name: odd})
            for name in ("time", "module", "site", "modules", "event", "details", "ways", "quantities")
        ]
    records += [
        ("note", {"event": kind, "details": {name: odd}})
        for kind in ("step-ended", "run-ended", "task-selected", "plan-accepted")
        for name in ("skill", "instruction", "steps", "reached", "measured", "reason")
    ]
    out = written_run(tmp_path / "out", records)
    lines = [odd, {"time": odd}, {"time": 1.0, "state": odd}, {"time": 2.0, "state": {"human_distance": odd}},
             {"time": 1.0, "kind": odd, "text": odd, "details": odd}]  # fmt: skip
    for name in ("trace.jsonl", "measured.jsonl"):
        (out / name).write_text("\n".join(map(json.dumps, lines)) + "\n[[[\n\xff")
    left = read_run_data(out)
    assert left.chain.is_sound
    assert "</html>" in page_of(left, "r", {}, "")

"""Old names lead to current names, which lead nowhere further."""

from __future__ import annotations

import json
from pathlib import PurePath

import pytest

from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Step, UnmigratableError
from aeros.spec.migrations.renamed_names import (
    RENAMED_EVENTS,
    current_event,
    plant_log_to_2,
    run_options_to_2,
    trace_to_2,
)
from aeros.spec.migrations.renamed_options import RENAMED_OPTIONS
from aeros.spec.migrations.rewriting import format_of, rewrite

LINE = {"time": 1.0, "kind": "routed", "text": "x", "details": {"kind": "routed"}}


def test_no_old_name_has_a_new_meaning_and_no_two_become_one() -> None:
    for names in (RENAMED_EVENTS, *RENAMED_OPTIONS.values()):
        assert not names.keys() & set(names.values())
        twice = {name for name in names.values() if list(names.values()).count(name) > 1}
        # These were renamed twice: `--record` became `--video`, and that `--film`.
        assert twice <= {"--film", "--no-film"}


def test_a_name_that_was_never_changed_stays() -> None:
    assert current_event("routed") == "task-selected"
    assert current_event("step-ended") == "step-ended"
    assert current_event("task-selected") == "task-selected"


def test_a_trace_gets_the_current_names_line_by_line() -> None:
    path, old = PurePath("trace.jsonl"), json.dumps(LINE) + "\n"
    new = {**LINE, "schema": "aeros/trace/2"}
    later = {**new, "kind": "plan-accepted"}
    assert format_of(path, old) is formats.TRACE
    rewritten = rewrite(path, old + json.dumps(later) + "\n", formats.TRACE)
    assert (rewritten.version, rewritten.is_changed) == (1, True)
    assert [json.loads(line) for line in rewritten.text.splitlines()] == [
        {**new, "kind": "task-selected"},
        later,
    ]
    assert rewrite(path, rewritten.text, formats.TRACE).text == rewritten.text


def test_a_log_of_a_plant_gets_the_current_names_line_by_line() -> None:
    path, line = PurePath("plant.jsonl"), {"event": "let-go", "time": 2.0, "measured": {}}
    text = json.dumps(line) + "\n"
    assert format_of(path, text) is formats.PLANT_LOG
    rewritten = rewrite(path, text, formats.PLANT_LOG)
    assert json.loads(rewritten.text) == {
        **line,
        "schema": formats.PLANT_LOG.schema,
        "event": "agent-disconnected",
    }
    assert rewrite(path, rewritten.text, formats.PLANT_LOG).text == rewritten.text


@pytest.mark.parametrize("text", ["[]\n", "{}\n", '{"kind": 3, "event": 3}\n'])
@pytest.mark.parametrize("step", [trace_to_2, plant_log_to_2])
def test_a_damaged_log_is_not_migrated(step: Step, text: str) -> None:
    with pytest.raises(UnmigratableError, match="it is damaged"):
        step(text)


def test_the_options_of_a_watched_run_get_their_current_names() -> None:
    old = {"schema": "aeros/run/1", "instruction": "fetch", "state": {"path": "/s"}, "no_record": True,
           "plan_within": 3.0, "person": None, "seed": 1}  # fmt: skip
    rewritten = rewrite(PurePath("run.json"), json.dumps(old), formats.RUN)
    assert json.loads(rewritten.text) == {
        "schema": "aeros/run/3",
        "instruction": "fetch",
        "state": {"path": "/s"},
        "seed": 1,
        "no_film": True,
        "planning_timeout": 3.0,
        "people": None,
    }
    with pytest.raises(UnmigratableError, match="it is damaged"):
        run_options_to_2("[]")

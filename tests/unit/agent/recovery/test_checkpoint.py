"""Checkpoints on disk: read back as they were, the newest first, and refused where anything is amiss."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.execution.progress import AttemptHistory, UnfinishedAttempt
from aeros.agent.execution.report import RunReport, StepRecord, StepRole
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.recovery.checkpoint import (
    SCHEMA,
    CheckpointStore,
    TaskCheckpoint,
    TaskEnd,
    UnusableCheckpointError,
    decode_checkpoint,
    encode_checkpoint,
)
from aeros.runtime.ports import LogHead, StepStatus

STEP = StepRecord(
    StepRole.RETRY, "m", "wrap", {"f": 0.5}, StepStatus.DENIED, None, True, "no", 1.0, 2.0, 3, 4, 5
)
UNFINISHED = UnfinishedAttempt("m", "boil", {}, {"cooked": False}, LogHead(7, "seven"))
REPORT = RunReport("make dumplings", "m", "make", "cooked", False, {"cooked": None}, (STEP,), 1, "it is cold")
FULL = TaskCheckpoint(
    agent="chef",
    instruction="dumplings",
    task="m.make",
    goal="cooked",
    time=2.5,
    audit_head=LogHead(9, "nine"),
    world={"cooked": None, "area": "pot"},
    replans=1,
    waited_s=3.0,
    deadline=60.0,
    denied_steps=("m.wrap",),
    avoided_skills=(("m", "wrap"),),
    uncertain_steps=('["m", "boil", {}]',),
    repeated_failures=("a failure",),
    last_plan_problems=("too long",),
    planning_states=({"cooked": False},),
    steps=(STEP,),
    plan=TaskGraph((PlanStep("m", "wrap", {"f": 0.5}, 1),), "a remark"),
    attempts=(
        ((0,), AttemptHistory(2, None, AttemptResult(failed=True, reason="no", record=STEP))),
        ((1, 0), AttemptHistory(1, UNFINISHED, None)),
    ),
    done_paths=((0,), (0, 1)),
    branch_choices=(((2,), True),),
)
ENDED = replace(FULL, plan=None, attempts=(), final_report=REPORT)
PATH = Path("checkpoint.json")


def again(checkpoint: TaskCheckpoint) -> TaskCheckpoint:
    return decode_checkpoint(encode_checkpoint(checkpoint), PATH)


@pytest.mark.parametrize("checkpoint", [FULL, ENDED, replace(FULL, plan=None, deadline=None)])
def test_every_field_is_read_as_it_was_written(checkpoint: TaskCheckpoint) -> None:
    assert again(checkpoint) == checkpoint


def test_the_same_state_gives_the_same_bytes() -> None:
    assert encode_checkpoint(FULL) == encode_checkpoint(again(FULL))


def test_the_progress_is_that_of_the_attempts_and_changes_nothing_of_them() -> None:
    progress = FULL.progress()
    assert (progress.done_paths, progress.branch_choices) == ({(0,), (0, 1)}, {(2,): True})
    assert progress.attempts == dict(FULL.attempts)
    progress.mark_done((5,))
    progress.set_branch((6,), then=False)
    assert FULL.progress().done_paths == {(0,), (0, 1)}


def test_the_earliest_head_is_of_the_earliest_unfinished_attempt() -> None:
    earlier = replace(UNFINISHED, head=LogHead(4, "four"))
    assert FULL.earliest_head == LogHead(7, "seven")
    assert replace(FULL, attempts=()).earliest_head == LogHead(9, "nine")
    both = (*FULL.attempts, ((3,), AttemptHistory(1, earlier)))
    assert replace(FULL, attempts=both).earliest_head == LogHead(4, "four")


def _without(name: str) -> Callable[[dict[str, Any]], Any]:
    return lambda kept: {key: value for key, value in kept.items() if key != name}


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda kept: kept | {"body": kept["body"].replace("chef", "cook")}, "its digest does not match"),
        (lambda kept: kept | {"digest": "0" * 64}, "its digest does not match"),
        (lambda kept: kept | {"schema": SCHEMA + 1}, "was written by a newer AEROS"),
        (lambda kept: kept | {"schema": SCHEMA - 1}, "is an older format"),
        (_without("digest"), "does not have the layout"),
        (_without("body"), "does not have the layout"),
        (lambda kept: [kept], "does not have the layout"),
        (lambda kept: kept | {"body": 7}, "does not have the layout"),
        (lambda kept: None, "does not have the layout"),
    ],
)
def test_an_incomplete_file_or_one_of_another_version_is_unusable(
    damage: Callable[[dict[str, Any]], Any], why: str
) -> None:
    content = json.dumps(damage(json.loads(encode_checkpoint(FULL)))).encode()
    with pytest.raises(UnusableCheckpointError, match=why):
        decode_checkpoint(content, PATH)


def test_a_file_that_is_cut_off_is_no_json() -> None:
    with pytest.raises(ValueError, match=r".+"):
        decode_checkpoint(encode_checkpoint(FULL)[:-9], PATH)


# In a folder.


def test_an_empty_folder_holds_no_checkpoint(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path)
    assert list(store.read()) == []
    assert store.read_final("dumplings") is None
    store.delete()


def test_two_generations_are_kept_and_the_newest_comes_first(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path)
    for replans in range(3):
        store.write(replace(FULL, replans=replans))
    assert list(store.read()) == [replace(FULL, replans=2), replace(FULL, replans=1)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["checkpoint.json", "checkpoint.previous.json"]


def test_a_damaged_checkpoint_is_reported_with_its_path_and_the_previous_one_is_read(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path)
    store.write(FULL)
    store.write(replace(FULL, replans=2))
    (tmp_path / "checkpoint.json").write_text("{")
    damaged, before = store.read()
    assert isinstance(damaged, UnusableCheckpointError)
    assert str(damaged).startswith(f"{tmp_path / 'checkpoint.json'}: ")
    assert before == FULL


def test_the_leftovers_of_a_killed_write_do_not_matter(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path)
    store.write(FULL)
    (tmp_path / "checkpoint.previous.json.new").write_text("half")
    store.write(replace(FULL, replans=2))
    assert [one.replans for one in store.read() if isinstance(one, TaskCheckpoint)] == [2, 1]


def test_the_final_checkpoint_is_the_only_one_and_says_how_the_task_ended(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path)
    store.write(FULL)
    store.write(FULL)
    store.write_final(ENDED)
    assert list(store.read()) == [ENDED]
    assert store.read_final("dumplings") == TaskEnd(REPORT, 2.5, LogHead(9, "nine"))
    assert store.read_final("noodles") is None


def test_a_task_that_goes_on_or_whose_checkpoint_is_damaged_has_no_end(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path)
    store.write(FULL)
    assert store.read_final("dumplings") is None
    (tmp_path / "checkpoint.json").write_text("{}")
    assert store.read_final("dumplings") is None


def test_nothing_is_left_of_deleted_checkpoints(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path)
    store.write(FULL)
    store.write(FULL)
    store.delete()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    store = CheckpointStore(tmp_path / "gone")
    with pytest.raises(AgentError, match=r"gone/checkpoint\.json cannot be written: No such file"):
        store.write(FULL)


def test_a_previous_checkpoint_that_cannot_be_removed_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = CheckpointStore(tmp_path)
    store.write(FULL)
    store.write(FULL)
    monkeypatch.setattr(CheckpointStore, "write", lambda *_: None)
    previous = tmp_path / "checkpoint.previous.json"
    previous.unlink()
    previous.mkdir()
    with pytest.raises(AgentError, match=r"checkpoint\.previous\.json cannot be removed: Is a directory"):
        store.write_final(ENDED)

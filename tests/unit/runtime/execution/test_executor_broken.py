"""Faults of AEROS, its plant or its record: nothing moves, and everything is cleaned up."""

from __future__ import annotations

import os
import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.descriptions import describe_exception
from aeros.runtime.audit.log import AuditError, AuditLog, verify_log
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.ports import MotionHandle
from aeros.skill import Inputs, Observation, SkillBody, act
from aeros.spec.diagnostics.errors import InternalError
from tests.unit.runtime.one_step import DENIAL, MakeBench, twice, watched


def test_a_decision_is_durable_before_its_motion(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = make_bench(twice)
    seen: list[int] = []
    begin = bench.plant.begin

    def checked(*arguments: Any) -> MotionHandle:
        seen.append(len(bench.records("decision")))
        return begin(*arguments)

    monkeypatch.setattr(bench.plant, "begin", checked)
    bench.submit()
    assert seen == [1, 2]


def _full_disk(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No file can grow by more than half a record: what is left of a disk that is nearly full."""
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (log.stat().st_size + 200, hard))


def _failing_sync(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(file: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fdatasync", broken)


@pytest.mark.parametrize(
    ("failure", "message"), [(_full_disk, "File too large"), (_failing_sync, "Input/output")]
)
def test_on_a_full_disk_or_a_failing_sync_nothing_moves(
    failure: Callable[[Path, pytest.MonkeyPatch], None],
    message: str,
    make_bench: MakeBench,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def body(observed: Observation, inputs: Inputs) -> SkillBody:
        failure(bench.log_path, monkeypatch)
        yield act("move", speed=0.1)

    bench = make_bench(body)
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        with pytest.raises(AuditError, match=message):
            bench.submit()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert bench.plant.executed == []
    bench.assert_cleaned_up(finished=False)
    bench.audit.close()
    monkeypatch.undo()
    AuditLog(bench.log_path).close()
    assert verify_log(bench.log_path).is_sound


def test_a_step_whose_beginning_cannot_be_recorded_does_not_begin(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = make_bench(twice)
    bench.audit.close()
    with pytest.raises(AuditError):
        bench.submit()
    assert bench.plant.calls == []


def test_a_gate_that_contradicts_itself_stops_everything(make_bench: MakeBench) -> None:
    ends: list[str] = []
    bench = make_bench(watched(ends))
    bench.gate.answers = [InternalError("closure allows, z3 denies")]
    with pytest.raises(InternalError, match="z3 denies"):
        bench.submit()
    assert (bench.plant.executed, ends) == ([], ["closed"])
    bench.assert_cleaned_up(finished=False)
    assert bench.records()[-1]["event"] == "step-broken"
    assert "closure allows, z3 denies" in bench.records()[-1]["details"]["reason"]


def test_an_allowance_without_an_action_is_an_internal_error(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.gate.answers = [Decision(DecisionKind.ALLOW, None, ())]
    with pytest.raises(InternalError):
        bench.submit()
    assert bench.plant.executed == []
    bench.assert_cleaned_up(finished=False)


@pytest.mark.parametrize("method", ["begin", "advance", "observe", "skill_began", "stop"])
def test_a_plant_that_raises_is_stopped_and_reported(make_bench: MakeBench, method: str) -> None:
    ends: list[str] = []
    bench = make_bench(watched(ends))
    bench.gate.answers = [Decision(DecisionKind.ALLOW, act("move"), ()), DENIAL]
    bench.plant.failing[method] = OSError("link lost")
    with pytest.raises(OSError, match="link lost"):
        bench.submit()
    bench.assert_cleaned_up(finished=False)
    assert bench.records()[-1]["event"] == "step-broken"


def test_an_interrupt_by_the_operator_stops_the_plant(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.plant.failing["advance"] = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        bench.submit()
    bench.assert_cleaned_up(finished=False)


def test_a_plant_that_fails_at_the_end_of_a_step_is_in_the_record(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.plant.failing["skill_ended"] = OSError("link lost")
    with pytest.raises(OSError, match="link lost"):
        bench.submit()
    broken = [one["details"]["reason"] for one in bench.records("step-broken")]
    assert broken == [describe_exception(OSError("link lost"))]

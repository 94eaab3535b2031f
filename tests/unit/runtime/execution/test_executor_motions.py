"""The whole motion is decided after the action, before the record."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.canonical_json import digest_of
from aeros.runtime.ports import MotionCompletion, NoMotion, StepResult, StepStatus, Trajectory
from aeros.runtime.records.records import motion_from_json
from aeros.spec.model.site import Site
from tests.unit.runtime.one_joint import DRIVES, PLAN, TURNS, governed
from tests.unit.runtime.one_step import Bench, twice
from tests.unit.runtime.together import Asking, Cart, asking, configuration, move, roll


def _moving_bench(site: Site, make_ecm: Any, path: Path, angle: float) -> Bench:
    bench = Bench(governed(site, "move"), make_ecm(""), path, twice)
    bench.plant.values["joint_angle"] = (angle,)
    bench.plant.planned = PLAN
    return bench


def test_the_decided_motion_is_executed_and_its_record_holds_it(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    bench = _moving_bench(site, make_ecm, tmp_path / "audit.jsonl", 0.0)
    assert bench.submit().status is StepStatus.FINISHED
    methods = [call[0] for call in bench.plant.calls]
    assert methods == ["skill_began", "plan", "begin", "advance", "plan", "begin", "advance", "skill_ended"]
    assert bench.plant.decided == [PLAN, PLAN]
    (body,) = bench.records("body")
    bodies = {digest_of(body["details"]["body"]): body["details"]["body"]}
    for record in bench.records("decision"):
        motion = record["details"]["motion"]
        assert motion_from_json(motion, bodies) == PLAN
        assert record["details"]["motion_digest"] == digest_of(motion)
    bench.audit.close()


def test_a_motion_that_is_not_in_order_is_denied_recorded_and_not_made(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    bench = _moving_bench(site, make_ecm, tmp_path / "audit.jsonl", 0.5)
    result = bench.submit()
    assert result.status is StepStatus.DENIED
    assert result.reason.startswith("AE761 joint_angle:")
    assert bench.plant.executed == []
    (record,) = bench.records("decision")
    assert record["details"]["verdict"] == "DENY"
    assert record["details"]["motion"]["duration"] == PLAN.duration
    assert record["details"]["gate"]["verdict"] == "ALLOW"
    bench.assert_cleaned_up(finished=False)
    bench.audit.close()


def test_an_impossible_motion_is_not_started_and_has_a_reason(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    bench = _moving_bench(site, make_ecm, tmp_path / "audit.jsonl", 0.0)
    bench.plant.planned = MotionCompletion(False, "unreachable: too far")
    assert bench.submit() == StepResult(StepStatus.STOPPED, "unreachable: too far", allowed=1, denials=1)
    assert bench.plant.executed == []
    bench.audit.close()


def _with_turning_base(tmp_path: Path, **bodies: Asking) -> Cart:
    """Moves turn the joint."""
    site = governed(configuration().site, "move", "roll")
    one = Cart(tmp_path / "audit.jsonl", bodies, under=replace(configuration(), site=site))
    one.plant.values["joint_angle"] = (0.0,)
    one.plant.planned = TURNS
    return one


@pytest.mark.parametrize(
    ("second", "reason"),
    [
        (NoMotion("it turns wheels that carry nothing"), None),
        (PLAN, None),
        (DRIVES, None),
        (TURNS, "AE764 roll: it and a motion under way would move the same part of the robot"),
        (replace(DRIVES, base_path=(0.02, 0.0, 0.0)), "AE762 tool-jerk"),
    ],
)
def test_a_second_motion_of_the_robot_is_decided_together_with_the_first(
    tmp_path: Path, second: Trajectory | NoMotion, reason: str | None
) -> None:
    one = _with_turning_base(tmp_path, reach=asking(move()), drive=asking(roll()))
    reach, drive = one.start("reach"), one.start("drive")
    plan = one.plant.plan
    one.plant.plan = lambda action: plan(action) if action.kind == "move" else second  # type: ignore[method-assign]
    results = one.ends(2)
    assert results[reach].status is StepStatus.FINISHED
    assert results[drive].status is (StepStatus.DENIED if reason else StepStatus.FINISHED)
    if reason:
        assert results[drive].reason.startswith(reason)
        assert one.records("decision")[-1]["gate"]["verdict"] == "ALLOW"
    one.audit.close()


def test_no_motion_starts_next_to_one_that_comes_to_rest(tmp_path: Path) -> None:
    one = _with_turning_base(tmp_path, reach=asking(move()), drive=asking(roll()))
    reach = one.start("reach")
    assert one.executor.wait(0.0) is None
    assert one.executor.wait(0.01) is None
    one.executor.cancel(reach, "enough")
    one.plant.planned = DRIVES
    drive = one.start("drive")
    results = one.ends(2)
    assert results[drive].reason.startswith("AE764 roll: the `move` under way is coming to rest")
    first, second = one.records("decision")
    assert second["beside"] == second["halting"] == [first["sequence"]]
    one.audit.close()

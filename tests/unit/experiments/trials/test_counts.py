"""The counts of a trial are those of the audit record and the plans."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.experiments.trial_plants import _CountingPlant
from aeros.experiments.trials import task
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.ports import MotionCompletion, NoMotion, PlannedMotion, Plant, RobotBody, Trajectory
from aeros.skill import Action, act
from aeros.spec.model.policy import Durability
from tests.unit.experiments.common import condition, premises


@pytest.mark.parametrize("architecture", ["flat", "aeros"])
def test_steps_and_actions_are_those_of_the_record(
    architecture: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    log = tmp_path / "audit.jsonl"

    @contextmanager
    def kept() -> Iterator[tuple[Path, AuditLog]]:
        with AuditLog(log, durability=Durability.BATCHED) as audit:
            yield tmp_path, audit

    monkeypatch.setattr(task, "scratch_folder", kept)
    found = []
    for seed in range(4):
        # A kind that has run nothing, so that there is nothing to be followed: each is rehearsed, and made.
        with task.TaskTrials().open(condition(architecture=architecture), premises()) as trial:
            found.append(trial(seed))
    records = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    events = Counter(one["event"] for one in records)
    started = [one for one in records if one["event"] == "decision" and one["details"]["verdict"] != "DENY"]
    assert 2 * sum(one["steps"] for one in found) == events["step-began"] > 8
    assert 2 * sum(one["actions"] for one in found) == len(started) > 80


class Planning:
    """A plant that plans what it is told to."""

    def __init__(self, *plans: PlannedMotion) -> None:
        self._plans = iter(plans)

    def plan(self, action: Action) -> PlannedMotion:
        return next(self._plans)


def test_each_corner_of_a_planned_path_is_a_solution_and_nothing_else_is() -> None:
    still = ((0.0,) * 7,) * 4
    moved = ((0.0,) * 7, (0.1,) * 7, (0.2,) * 7, (0.3,) * 7)
    body, nowhere = RobotBody((), (0.0, 0.0, 0.0), ()), (0.0, 0.0, 0.0)

    def along(*paths: Any) -> Trajectory:
        return Trajectory(body, paths, nowhere, nowhere, 1.0)

    plans = (
        along((moved, moved, moved)),
        along((moved, moved), (moved,)),
        along((still,)),
        NoMotion("it waits"),
        MotionCompletion(False, "unreachable"),
    )
    counts = {"ik_solutions": 0}
    plant = _CountingPlant(cast(Plant, Planning(*plans)), counts)
    seen = []
    for _ in plans:
        plant.plan(act("move_tool"))
        seen.append(counts["ik_solutions"])
    assert seen == [4, 4 + 3 + 2, 9, 9, 9]

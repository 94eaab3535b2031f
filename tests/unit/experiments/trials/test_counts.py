"""The counts of a trial are those of the audit record and the plans."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from aeros.experiments.trials import task
from aeros.runtime.audit.log import AuditLog
from aeros.spec.model.policy import Durability
from tests.unit.experiments.support.common import condition, premises


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

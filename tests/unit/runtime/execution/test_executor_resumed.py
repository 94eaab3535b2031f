"""A session that goes on after a crash: what was counted counts, what was seen was seen, and then a gap."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditError, AuditLog, verify_log
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import Configuration, single_configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import EMPTY_LOG_HEAD, LogHead, StepRequest, StepResult, StepStatus
from aeros.runtime.records.replay import LogReplay
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.spec.model.site import Site
from tests.unit.runtime.monitor.test_history import CODE, STEP, Bench


class Crashing:
    """A bench whose executor ends at each `crash`, and whose plant and log do not."""

    def __init__(self, folder: Path, bench: Bench, configuration: Configuration) -> None:
        self.path = folder / "resumed.jsonl"
        self.plant, self.configuration = bench.plant, configuration
        self.log = AuditLog(self.path)
        self.executor = self.made(resumed=False)

    def made(self, *, resumed: bool) -> Executor:
        gate = CompiledGate(self.configuration, GateMode.CHECKED)
        return Executor(self.configuration, gate, self.plant, self.log, run_in_process, resumed=resumed)

    def crash(self) -> None:
        self.log.close()
        self.log = AuditLog(self.path)
        self.executor = self.made(resumed=True)

    def lift_at(self, time: float, distance: float = 20.0) -> StepResult:
        self.plant.time, self.plant.values["human_distance"] = time, distance
        return self.executor.run_step(StepRequest("handling", "lift", {}))

    def replayed(self) -> LogReplay:
        replay = LogReplay(single_configuration(self.configuration))
        for line in self.path.read_bytes().splitlines():
            replay.replay_record(json.loads(line))
        return replay


@pytest.fixture
def bench(site: Site, make_ecm: Any, tmp_path: Path) -> Bench:
    return Bench(site, make_ecm(CODE), AuditLog(tmp_path / "unused.jsonl"))


@pytest.fixture
def remembering(bench: Bench, tmp_path: Path) -> Crashing:
    return Crashing(tmp_path, bench, bench.configuration)


@pytest.fixture
def counting(bench: Bench, site: Site, tmp_path: Path) -> Crashing:
    (quota,) = site.quotas
    counted = replace(
        site,
        quotas=(replace(quota, kinds=frozenset({"move"}), max_count=2),),
        access=bench.configuration.site.access,
    )
    return Crashing(tmp_path, bench, replace(bench.configuration, site=counted))


def test_counts_from_before_a_crash_hold_after_it(counting: Crashing) -> None:
    assert counting.lift_at(0.0).status is StepStatus.FINISHED
    counting.crash()
    assert counting.lift_at(STEP).status is StepStatus.FINISHED
    counting.crash()
    denied = counting.lift_at(2 * STEP)
    assert denied.status is StepStatus.DENIED
    assert counting.configuration.site.quotas[0].id in denied.reason
    assert (counting.replayed().mismatches, counting.replayed().matching_count) == ([], 3)


def test_history_before_a_crash_is_kept_and_the_gap_after_it_is_unknown(
    remembering: Crashing,
) -> None:
    assert remembering.lift_at(0.0).status is StepStatus.FINISHED
    assert remembering.lift_at(STEP, 1.5).status is StepStatus.DENIED
    remembering.crash()
    # Nobody is near any more, but somebody was, less than 5 s ago.
    assert remembering.lift_at(2 * STEP).reason.startswith(("AE750 memory", "AE703"))
    assert remembering.lift_at(3 * STEP).status is StepStatus.DENIED
    assert remembering.replayed().mismatches == []


def test_that_nobody_looked_meanwhile_denies_until_it_cannot_matter(remembering: Crashing) -> None:
    assert remembering.lift_at(0.0).status is StepStatus.FINISHED
    remembering.crash()
    assert remembering.lift_at(STEP).reason.startswith("AE703")
    # Looked at often enough to see anyone who comes, for as long as the rule reaches back.
    statuses = [remembering.lift_at(tick * STEP).status for tick in range(2, 84)]
    assert statuses.index(StepStatus.FINISHED) > 75
    assert remembering.replayed().mismatches == []


def test_the_record_goes_on_in_one_chain(remembering: Crashing) -> None:
    remembering.lift_at(0.0)
    remembering.executor.note("session-opened", {})
    before = remembering.executor.log_head()
    remembering.crash()
    assert verify_log(remembering.path).is_sound
    events = [one.event for one in remembering.executor.events_since(EMPTY_LOG_HEAD) or ()]
    assert events == ["session-opened", "step-began", "decision", "step-ended", "session-resumed"]
    (resumed,) = remembering.executor.events_since(before) or ()
    assert (resumed.sequence, resumed.event) == (before.records, "session-resumed")
    assert resumed.details["site"]["digest"] == remembering.configuration.site.digest
    assert remembering.executor.events_since(LogHead(before.records, "0" * 64)) is None
    assert remembering.executor.events_since(LogHead(before.records + 5, before.hash)) is None


def test_a_session_that_is_not_resumed_begins_anew(remembering: Crashing) -> None:
    remembering.lift_at(0.0)
    remembering.made(resumed=False)
    events = [one.event for one in remembering.executor.events_since(EMPTY_LOG_HEAD) or ()]
    assert events == ["session-opened", "step-began", "decision", "step-ended", "session-opened"]


@pytest.mark.parametrize("event", ["session-opened", "session-resumed", "configuration-changed"])
def test_under_another_site_nothing_is_resumed(remembering: Crashing, event: str) -> None:
    if event == "session-opened":
        site = replace(remembering.configuration.site, digest="6" * 64)
        remembering.configuration = replace(remembering.configuration, site=site)
    else:
        remembering.log.append(event, {"site": {"digest": "6" * 64}})
    with pytest.raises(AuditError) as caught:
        remembering.crash()
    assert str(caught.value) == (
        f"`{remembering.path}` cannot be resumed: another site was in force, or other blocks of the "
        "operator; start the task again"
    )


@pytest.mark.parametrize(
    ("changes", "is_open"),
    [
        ((), False),
        (("began",), True),
        (("began", "ended"), False),
        (("began", "broken"), False),
        (("began", "began", "broken"), True),
        (("began", "began", "ended"), True),
    ],
)
def test_a_stop_that_nobody_saw_is_recorded_if_a_step_was_under_way(
    remembering: Crashing, changes: tuple[str, ...], is_open: bool
) -> None:
    for change in changes:
        remembering.log.append(f"step-{change}", {})
    remembering.plant.time = 7.5
    remembering.crash()
    records = [json.loads(line) for line in remembering.path.read_bytes().splitlines()]
    assert records[-2 if is_open else -1]["event"] == "session-resumed"
    stops = [one["details"] for one in records if one["event"] == "stopped"]
    assert len(stops) == is_open
    for stop in stops:
        assert stop["quantities"].pop("human_distance") == {"least": 20.0, "greatest": 20.0, "unit": "m"}
        assert stop == {
            "time": 7.5,
            "ticks": 1,
            "reason": "the agent was lost; the plant stopped by itself, unseen",
            "quantities": {},
            "ways": {},
        }

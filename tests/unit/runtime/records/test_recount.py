"""A log whose histories cannot be what was decided before them is found out."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import digest_of
from aeros.runtime.gate.configuration import single_configuration
from aeros.runtime.records.replay import LogReplay
from aeros.spec.model.site import Site
from tests.unit.runtime.monitor.test_history import CODE, NAME, STEP, Bench

Records = list[dict[str, Any]]
Change = Callable[[Records], None]
NEAR, FAR = 1.5, 20.0


@pytest.fixture
def made(site: Site, make_ecm: Any, tmp_path: Path) -> tuple[Bench, Path]:
    log = tmp_path / "audit.jsonl"
    return Bench(site, make_ecm(CODE), AuditLog(log)), log


def replayed(made: tuple[Bench, Path], change: Change = lambda records: None) -> LogReplay:
    bench, log = made
    records = [json.loads(line) for line in log.read_bytes().splitlines()]
    change([record["details"] for record in records if record["event"] == "decision"])
    replay = LogReplay(single_configuration(bench.configuration))
    for record in records:
        replay.replay_record(record)
    return replay


def forgetting(records: Records, at: int, history: bool | None) -> None:
    """Of a decision that was denied for what had been: that nothing had been, and so it was allowed."""
    details, allowed = records[at], copy.deepcopy(records[0])
    details["state"][NAME] = [history, details["time"]]
    if history is None:
        del details["state"][NAME]
    details["state_digest"] = digest_of(details["state"])
    if history is False:
        details.update({name: allowed[name] for name in ("verdict", "decided", "reasons")})
        details.pop("causes", None)


def test_values_of_an_earlier_decision_cannot_be_dropped(made: tuple[Bench, Path]) -> None:
    bench, _ = made
    for tick, distance in enumerate((FAR, NEAR, FAR)):
        bench.lift_at(tick * STEP, distance)
    assert (replayed(made).mismatches, replayed(made).matching_count) == ([], 3)
    for history, message in ((False, "False"), (None, "unknown")):
        (found,) = replayed(
            made,
            lambda records, history=history: forgetting(records, 2, history),  # type: ignore[misc]
        ).mismatches
        assert found.reason == (
            f"the history `{NAME}` is recorded as {message}, but the earlier decisions give True"
        )


def test_before_a_motion_starts_only_decisions_have_measured(
    made: tuple[Bench, Path],
) -> None:
    bench, _ = made
    bench.lift_at(0.0, FAR)
    (found,) = replayed(made, lambda records: forgetting(records, 0, history=True)).mismatches
    assert found.reason.endswith("is recorded as True, but the earlier decisions give False")


def test_values_of_an_unrecorded_tick_are_used_as_recorded(made: tuple[Bench, Path]) -> None:
    bench, _ = made
    bench.plant.during = [{}, {"human_distance": NEAR}]
    bench.lift()
    bench.plant.during = []
    bench.lift_at(STEP, FAR)
    replay = replayed(made)
    assert (replay.mismatches, replay.matching_count) == ([], 2)
    assert replayed(made, lambda records: forgetting(records, 1, history=False)).matching_count == 2


def test_a_clock_that_went_back_leaves_nothing_known_again(made: tuple[Bench, Path]) -> None:
    bench, _ = made
    for time in (1.0, 0.5, 1.5):
        bench.lift_at(time, NEAR)
    replay = replayed(made)
    assert (replay.mismatches, replay.matching_count) == ([], 3)

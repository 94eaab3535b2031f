"""An agent that keeps crashing is left asleep; crashes that are far apart are no loop."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.agent.agent import start_agent
from aeros.agent.errors import AgentError
from aeros.agent.recovery.quarantine import Quarantine
from tests.unit.agent.fake_runtime import FakeRuntime

WHY = "killed by SIGKILL"


def test_so_many_crashes_within_so_long_are_a_loop_and_survive_the_watchdog(tmp_path: Path) -> None:
    for at in (1000.0, 1010.0):
        assert Quarantine(tmp_path).record_crash(WHY, at, most=3, within=60.0) is None
    reason = Quarantine(tmp_path).record_crash(WHY, 1060.0, most=3, within=60.0)
    assert reason == "it crashed 3 times within 60 s; the last time, killed by SIGKILL"
    shown = Quarantine(tmp_path).reason()
    assert shown is not None
    assert shown.startswith(f"this agent is in quarantine: {reason} (since 1970-01-01T00:17:40+00:00)")


def test_crashes_that_are_far_apart_are_none(tmp_path: Path) -> None:
    quarantine = Quarantine(tmp_path)
    for at in (1000.0, 1061.0, 1122.0, 1183.0):
        assert quarantine.record_crash(WHY, at, most=2, within=60.0) is None
    assert quarantine.reason() is None


def test_a_clock_that_was_set_back_counts_from_then(tmp_path: Path) -> None:
    quarantine = Quarantine(tmp_path)
    assert quarantine.record_crash(WHY, 1000.0, most=2, within=60.0) is None
    assert quarantine.record_crash(WHY, 500.0, most=2, within=60.0) is None
    assert quarantine.record_crash(WHY, 510.0, most=2, within=60.0) is not None


def test_in_quarantine_nobody_wakes_until_it_is_released(tmp_path: Path) -> None:
    quarantine = Quarantine(tmp_path)
    quarantine.record_crash(WHY, 1000.0, most=1, within=60.0)
    with (
        pytest.raises(AgentError, match=r"in quarantine: it crashed 1 times .+`aeros release`"),
        start_agent(tmp_path, "chef", FakeRuntime()),
    ):
        pass
    assert quarantine.clear()
    assert not quarantine.clear()
    with start_agent(tmp_path, "chef", FakeRuntime()) as agent:
        assert agent.run("dumplings").reached
    assert quarantine.record_crash(WHY, 1001.0, most=2, within=60.0) is None


@pytest.mark.parametrize("text", ["", "{", "[]"])
def test_a_quarantine_that_cannot_be_read_is_one(tmp_path: Path, text: str) -> None:
    (tmp_path / "quarantine.json").write_text(text)
    assert "gives no reason" in str(Quarantine(tmp_path).reason())

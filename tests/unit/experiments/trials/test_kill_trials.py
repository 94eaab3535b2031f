"""Violations after kill -9 are found in the plant's own log, and times are measured."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.trials.kill_logs import motion_without_agent, repeated_skills
from aeros.experiments.trials.kills import KIND, KillTrial, PlantLogTimes, findings_of
from tests.unit.experiments.common import premises

MODULES = premises().configuration.modules
HERE = {"joint_position": [0.0] * 7, "joint_velocity": [0.0] * 7}


def log_line(
    event: str, at: float = 1.0, skill: str = "make_dumplings.boil", **measured: Any
) -> dict[str, Any]:
    finished = {"finished": True} if event == "skill-ended" else {}
    return {"event": event, "time": at, "skill": skill, **finished, "measured": {**HERE, **measured}}


BOILED = [log_line("skill-began"), log_line("skill-ended", dumpling_cooked=True)]


def test_a_skill_that_begins_while_its_success_is_measured_is_repeated() -> None:
    assert repeated_skills(BOILED, MODULES) == []
    assert repeated_skills([*BOILED, log_line("skill-began", dumpling_cooked=False)], MODULES) == []
    (found,) = repeated_skills([*BOILED, log_line("skill-began", at=7.0, dumpling_cooked=True)], MODULES)
    assert found.startswith("once: make_dumplings.boil at 7.00 s")


@pytest.mark.parametrize(
    ("log", "message"),
    [
        ([log_line("let-go", joint_velocity=[0.1] + [0.0] * 6)], "a joint moved at 0.1000 rad/s"),
        ([log_line("let-go"), log_line("connected", at=1.5)], "time went on without an agent"),
        ([log_line("let-go"), log_line("skill-began")], "time went on without an agent"),
        ([log_line("let-go"), log_line("connected", joint_position=[0.2] + [0.0] * 6)], "moved by 0.2 rad"),
    ],
)
def test_what_moves_while_nobody_is_there_is_found(log: list[dict[str, Any]], message: str) -> None:
    (found,) = motion_without_agent(log, "symbolic")
    assert message in found
    assert motion_without_agent([log_line("let-go"), log_line("connected")], "symbolic") == []


def test_what_was_found_is_counted_by_its_kind() -> None:
    trial = KillTrial(0, ["agent"], violations=["once: a", "once: b", "stopped: c", "what the agent said"])
    found = findings_of(trial)
    assert (found["repeated"], found["lost"], found["moved"], found["ended"]) == (2, 0, True, True)
    assert "to_stop_s" not in found
    trial = KillTrial(
        0, violations=["ended: no record says so", "kept: x"], stop_times_s=[0.1, 0.3], resume_times_s=[2.0]
    )
    found = findings_of(trial)
    assert (found["lost"], found["ended"], found["to_resume_s"]) == (1, False, 2.0)
    assert found["to_stop_s"] == pytest.approx(0.2)


def test_times_are_from_a_kill_to_rest_and_to_the_next_skill_after_it(tmp_path: Path) -> None:
    log = tmp_path / "plant.jsonl"
    stamps = PlantLogTimes(log)
    killed, count = [], 0
    with log.open("a", encoding="utf-8", buffering=1) as file:
        for events in (["skill-began", "let-go", "skill-began"], ["skill-began"], []):
            killed.append(time.monotonic())
            for event in events:
                time.sleep(0.06)
                file.write(json.dumps({"event": event}) + "\n")
                count += 1
                while len(stamps._lines) < count and time.monotonic() < killed[0] + 60.0:
                    time.sleep(0.001)
    stamps.end()
    stops, resumes = stamps.stop_and_resume_times(killed)
    assert stamps.stop_and_resume_times([]) == ([], [])
    (stop,), (first, second) = stops, resumes
    # What began between kill and rest was begun by an agent that had not noticed yet.
    assert 0.12 <= stop < first
    assert first >= 0.18
    assert second >= 0.06


def test_what_docs_promise_is_what_is_predicted() -> None:
    settings = {"instruction": "make dumplings", "victims": ["agent"], "on": "symbolic"}
    expected = KIND.expected_values(TrialCondition.create("kills", "physics", settings), premises())
    assert expected == {"ended": 1.0, "repeated": 0.0, "lost": 0.0, "moved": 0.0}

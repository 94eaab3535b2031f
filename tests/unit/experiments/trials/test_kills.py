"""Violations after kill -9 are found in the plant's own log, and times are measured."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, ClassVar, cast

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.trials import kills
from aeros.experiments.trials.kills import (
    KIND,
    KillTrial,
    PlantLogTimes,
    _descendants,
    _holder_of,
    _judge,
    _SupervisedTask,
    findings_of,
    trial_of,
)
from aeros.runtime.audit.log import AuditLog
from tests.unit.experiments.support.common import premises
from tests.unit.experiments.trials.plant_log import BOILED, MODULES, log_line


def test_findings_are_counted_by_kind() -> None:
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
        for events in (["skill-began", "agent-disconnected", "skill-began"], ["skill-began"], []):
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
    # The agent that started these had not noticed the kill yet.
    assert 0.12 <= stop < first
    assert first >= 0.18
    assert second >= 0.06


def test_predictions_are_the_numbers_of_the_docs() -> None:
    settings = {"instruction": "make dumplings", "victims": ["agent"], "on": "symbolic"}
    expected = KIND.expected_values(TrialCondition.create("kills", "physics", settings), premises())
    assert expected == {"ended": 1.0, "repeated": 0.0, "lost": 0.0, "moved": 0.0}


# Processes.


def _lock(folder: Path, text: str) -> int:
    folder.mkdir(exist_ok=True)
    (folder / "agent.lock").write_text(text)
    return _holder_of(folder)


def test_a_folder_is_held_by_a_living_process_or_nobody(tmp_path: Path) -> None:
    assert _holder_of(tmp_path / "none") == 0
    assert _lock(tmp_path, json.dumps({"pid": os.getpid()})) == os.getpid()
    assert _lock(tmp_path, json.dumps({"pid": 2**22 + 1})) == 0
    assert [_lock(tmp_path, text) for text in ("", "{", "{}", '{"pid": "x"}')] == [0, 0, 0, 0]


def test_the_processes_of_a_process_are_found_through_all_generations() -> None:
    command = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'input()'])"
    with subprocess.Popen([sys.executable, "-c", command], stdin=subprocess.PIPE) as child:
        latest = time.monotonic() + 20.0
        while not _descendants(child.pid) and time.monotonic() < latest:
            time.sleep(0.01)
        (grandchild,) = _descendants(child.pid)
        assert {child.pid, grandchild} <= set(_descendants(os.getpid()))
        assert child.stdin is not None
        child.stdin.close()
    assert _descendants(child.pid) == []
    assert _descendants(0) == []


# Judging a task that has ended.


class Ended:
    """A task that has ended: its folders, and what it lost."""

    def __init__(self, folder: Path, *events: tuple[str, dict[str, Any]], lost: int = 0) -> None:
        self.state, self.out = folder / "state", folder / "out"
        self.log = self.out / "audit.jsonl"
        self._lost = ["kept: gone"] * lost
        for path in (self.state, self.out):
            path.mkdir(exist_ok=True)
        with AuditLog(self.log) as log:
            for event, details in events:
                log.append("note", {"event": event, "details": details})

    def lost_records(self) -> list[str]:
        return self._lost

    def judged(self, *plant_log: dict[str, Any]) -> KillTrial:
        text = "".join(json.dumps(line) + "\n" for line in plant_log)
        (self.out / "plant.jsonl").write_text(text)
        trial = KillTrial(0)
        _judge(trial, cast(_SupervisedTask, self), "symbolic", MODULES)
        return trial


REACHED = ("run-ended", {"reached": True, "reason": None})
FAILED = ("run-ended", {"reached": False, "reason": "it is late"})
CRASHED = ("lifecycle", {"change": "crash"})


def test_a_task_that_reached_its_goal_breaks_nothing(tmp_path: Path) -> None:
    beginning = ("lifecycle", {"change": "begin"})
    trial = Ended(tmp_path, beginning, CRASHED, ("run-resumed", {}), CRASHED, REACHED).judged(*BOILED)
    assert (trial.reached, trial.failure_reason, trial.violations) == (True, "", [])
    assert (trial.recovered, trial.resumed, trial.kills_in_motion) == (2, 1, 0)


def test_the_last_end_says_why_it_failed_unless_an_end_reached_the_goal(tmp_path: Path) -> None:
    early = ("run-ended", {"reached": False, "reason": "it is early"})
    trial = Ended(tmp_path, early, FAILED).judged()
    assert (trial.reached, trial.failure_reason) == (False, "it is late")
    (tmp_path / "again").mkdir()
    trial = Ended(tmp_path / "again", REACHED, FAILED).judged()
    assert (trial.reached, trial.failure_reason) == (True, "")


def test_violations_are_listed(tmp_path: Path) -> None:
    ended = Ended(tmp_path, lost=2)
    (ended.state / "run.json").touch()
    again = log_line("skill-began", at=7.0, cooked=True)
    gone = {**log_line("agent-disconnected", joint_velocity=[0.1] * 7), "amid_motion": True}
    trial = ended.judged(*BOILED, again, gone)
    assert [text.partition(":")[0] for text in trial.violations] == [
        "ended",
        "ended",
        "kept",
        "kept",
        "once",
        "stopped",
    ]
    assert (trial.kills_in_motion, trial.reached) == (1, False)


def test_a_log_that_was_altered_is_not_kept(tmp_path: Path) -> None:
    ended = Ended(tmp_path, CRASHED, REACHED)
    ended.log.write_bytes(ended.log.read_bytes().replace(b"crash", b"smash"))
    (violation,) = ended.judged().violations
    assert violation.startswith("kept: record 0: ")


# One trial.


class Supervised:
    """A supervised task that is killed as it is asked, and ends at once."""

    made: ClassVar[list[Supervised]] = []

    def __init__(self, trial: KillTrial, plant: str, folder: Path, *asked: Any) -> None:
        self.trial, self.plant, self.asked = trial, plant, asked
        (folder / "said").write_text("the agent said this")
        self.made.append(self)

    def is_awake(self) -> bool:
        return True

    def has_ended(self) -> bool:
        return False

    def kill(self, victim: str) -> bool:
        self.trial.kills.append(victim)
        return True

    def end(self) -> None:
        self.trial.kills.append("end")


@pytest.fixture
def slept(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Supervised tasks that are made up, and how long is slept before each kill."""
    seen: list[float] = []
    Supervised.made.clear()
    monkeypatch.setattr(kills, "_SupervisedTask", Supervised)
    monkeypatch.setattr(kills, "_judge", lambda *_: None)
    monkeypatch.setattr("aeros.experiments.trials.kills.time.sleep", seen.append)
    return seen


def tried(seed: int, duration: float = 10.0, instruction: str = "make dumplings", **more: Any) -> KillTrial:
    return trial_of(seed, "symbolic", MODULES, duration, premises().paths, instruction, **more)


def test_a_task_is_killed_up_to_three_times_and_then_ends(slept: list[float]) -> None:
    counts, total = set(), 0
    for seed in range(30):
        trial = tried(seed, victims=("agent", "worker"))
        total += len(trial.kills) - 1
        assert trial.kills[-1] == "end"
        assert set(trial.kills[:-1]) <= {"agent", "worker"}
        counts.add(len(trial.kills) - 1)
        assert trial.violations == []
    assert counts == {1, 2, 3}
    assert len(slept) == total
    assert all(0.0 <= one <= 10.0 for one in slept)
    assert any(one > 2.0 for one in slept)


@pytest.mark.usefixtures("slept")
def test_a_seed_draws_the_same_kills_again() -> None:
    assert tried(5).kills == tried(5).kills
    assert {"agent", "worker", "watchdog", "end"} == {one for seed in range(20) for one in tried(seed).kills}


@pytest.mark.usefixtures("slept")
def test_plant_and_instruction_are_passed_on() -> None:
    tried(0, instruction="clean the table", longest=5.0)
    (made,) = Supervised.made
    assert (made.plant, made.asked) == ("symbolic", (premises().paths, "clean the table", 5.0))


@pytest.mark.usefixtures("slept")
def test_a_failure_is_reported_with_the_output_of_the_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kills, "_judge", lambda trial, *_: trial.violations.append("once: x"))
    assert tried(0).violations == ["once: x", "the agent said this"]


# A task under its watchdog, whose processes are made up.


class Process:
    """A watchdog that runs until it is waited for, or killed."""

    started: ClassVar[list[tuple[list[str], dict[str, Any]]]] = []

    def __init__(self, command: list[str], **how: Any) -> None:
        self.started.append((command, how))
        self.pid = 10**6 + len(self.started)
        self.code: int | None = None
        self.is_stuck = False

    def poll(self) -> int | None:
        return self.code

    def wait(self, timeout: float | None = None) -> int:
        if timeout is not None and self.is_stuck:
            raise subprocess.TimeoutExpired("aeros", timeout)
        self.code = 0
        return 0


@pytest.fixture
def killed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Collect the processes that are killed, with the signals; every process is alive."""
    seen: list[tuple[int, int]] = []
    Process.started.clear()
    monkeypatch.setattr("aeros.experiments.trials.kills.subprocess.Popen", Process)
    monkeypatch.setattr("aeros.experiments.trials.kills.os.kill", lambda *given: seen.append(given))
    monkeypatch.setattr(kills, "_descendants", lambda pid: [pid + 1] if pid else [])
    monkeypatch.setattr(kills, "_SHUTDOWN_S", 0.0)
    return seen


def _life(folder: Path, longest: float = 0.5) -> tuple[_SupervisedTask, KillTrial]:
    trial = KillTrial(3)
    return _SupervisedTask(trial, "symbolic", folder, premises().paths, "make dumplings", longest), trial


def _wake(life: _SupervisedTask, monkeypatch: pytest.MonkeyPatch, pid: int) -> None:
    monkeypatch.setattr(kills, "_holder_of", lambda folder: pid if folder == life.state else 0)


@pytest.mark.usefixtures("killed")
def test_the_task_runs_under_a_watchdog_with_folders_of_its_own(tmp_path: Path) -> None:
    life, _ = _life(tmp_path)
    ((command, how),) = Process.started
    assert command[1:5] == ["-m", "aeros", "run", "make dumplings"]
    for option, value in (
        ("--plant", "symbolic"),
        ("--seed", "3"),
        ("--out", str(tmp_path / "out")),
        ("--state", str(tmp_path / "state")),
        ("--max-crashes", "1000"),
    ):
        assert command[command.index(option) + 1] == value
    assert "--watchdog" in command
    assert "--site" not in command
    assert how["env"]["PYTHONPATH"].split(os.pathsep)[0] == str(Path(kills.__file__).parents[3])
    life.end()


def test_nobody_is_killed_who_is_not_there(
    tmp_path: Path, killed: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    life, trial = _life(tmp_path)
    _wake(life, monkeypatch, 0)
    assert [life.kill(victim) for victim in ("agent", "worker")] == [False, False]
    _wake(life, monkeypatch, life._watchdog.pid)  # which holds the folder for a moment
    assert (life.is_awake(), life.kill("agent")) == (False, False)
    life._watchdog.wait()
    _wake(life, monkeypatch, 77)
    assert (life.has_ended(), life.kill("agent"), life.kill("watchdog")) == (True, False, False)
    assert (killed, trial.kills) == ([], [])
    life.end()


def test_a_victim_is_killed_and_a_watchdog_started_again(
    tmp_path: Path, killed: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    life, trial = _life(tmp_path)
    first = life._watchdog.pid
    _wake(life, monkeypatch, 77)
    assert (life.is_awake(), life.has_ended()) == (True, False)
    assert [life.kill(victim) for victim in ("agent", "worker", "watchdog")] == [True, True, True]
    life.state.mkdir()
    (life.state / "run.json").touch()
    assert life.kill("watchdog")
    assert killed == [(77, 9), (78, 9), (first, 9), (first + 1, 9)]
    assert trial.kills == ["agent", "worker", "watchdog", "watchdog"]
    asked = [command[4] for command, _ in Process.started]
    assert asked == ["make dumplings", "make dumplings", "--resume"]  # anew where nothing was recorded yet
    life.end()
    assert trial.violations == []


@pytest.mark.usefixtures("killed")
def test_records_that_were_there_at_a_kill_must_be_there_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    life, _ = _life(tmp_path)
    _wake(life, monkeypatch, 77)
    assert life.kill("agent")  # before there is a log
    life.out.mkdir()
    life.log.write_bytes(b"one\ntw")
    assert life.kill("agent")
    life.log.write_bytes(b"one\ntwo\n")
    assert life.kill("agent")
    assert life.lost_records() == []
    life.log.write_bytes(b"one\nthree\n")
    assert life.lost_records() == ["kept: records that were there at a kill are not"]
    life.log.unlink()
    assert len(life.lost_records()) == 2
    life.end()


def test_a_task_that_does_not_end_is_killed_and_that_is_reported(
    tmp_path: Path, killed: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    life, trial = _life(tmp_path, longest=0.25)
    _wake(life, monkeypatch, 77)
    cast(Process, life._watchdog).is_stuck = True
    life.end()
    assert trial.violations == ["ended: not after 0.25 s"]
    assert killed == [(life._watchdog.pid, 9), (77, 9)]
    assert life.has_ended()


def test_a_plant_that_is_left_behind_is_ended(
    tmp_path: Path, killed: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    life, trial = _life(tmp_path)
    monkeypatch.setattr(kills, "_holder_of", lambda folder: 88 if folder == life.state / "plant" else 0)
    life.end()
    assert (killed, trial.violations) == ([(88, 9)], [])

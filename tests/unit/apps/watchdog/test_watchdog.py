"""An agent under its watchdog, as processes: killed, interrupted, stopped, and in quarantine."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.recovery.quarantine import Quarantine
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.experiments.trials.kills import VICTIMS, trial_of
from aeros.runtime.audit.log import verify_log
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import OperatorCommands
from aeros.session.plant_factory import PlantSetupError, connect_plant
from tests.repo.tree import ROOT
from tests.unit.experiments.support.common import WHERE, premises

MODULE = "ecms/make_dumplings"

PATIENCE = 60.0
"""Real seconds within which anything that a test waits for has happened."""


class Watched:
    """A task under a watchdog, in a folder of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.state, self.out = folder / "state", folder / "out"
        self._known: tuple[int, list[dict[str, Any]]] = 0, []
        task = ("make dumplings", "--ecms", MODULE, "--plant", "symbolic")
        self.process = self.start(*task, "--out", str(self.out), *options)

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "aeros", "run", *arguments, "--watchdog", "--state", str(self.state)]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, cwd=ROOT, stdout=pipe, stderr=subprocess.STDOUT, text=True)

    @classmethod
    def paused(cls, folder: Path, *options: str) -> Watched:
        """One whose agent waits for the operator to resume, and has not ended, however slow we are."""
        OperatorCommands(Registry(folder / "state").folder, resumed=False).close()
        asked("pause", folder / "state")
        watched = cls(folder, *options)
        watched.until(lambda: watched.phases()[-1:] == ["paused"])
        return watched

    @classmethod
    def killed(cls, folder: Path) -> Watched:
        """One whose watchdog and agent are gone, while its plant and its task are there."""
        watched = cls.paused(folder)
        for pid in (watched.process.pid, watched.agent()):
            os.kill(pid, signal.SIGKILL)
        watched.end()
        asked("resume", watched.state)
        return watched

    def kill_plant(self) -> None:
        plant = json.loads((self.state / "plant" / "agent.lock").read_text())["pid"]
        os.kill(plant, signal.SIGKILL)

    def until(self, holds: Callable[[], Any]) -> Any:
        latest = time.monotonic() + PATIENCE
        while not (found := holds()):
            assert time.monotonic() < latest
            assert self.process.poll() is None
            time.sleep(0.005)
        return found

    def agent(self, other_than: int = 0) -> int:
        """The process that holds the agent's folder; the watchdog does so for a moment itself."""
        try:
            pid = int(json.loads((self.state / "agent.lock").read_text())["pid"])
        except (OSError, ValueError):
            return 0
        return 0 if pid in (other_than, self.process.pid) else pid

    def events(self) -> list[dict[str, Any]]:
        path = self.out / "audit.jsonl"
        log = path.read_bytes() if path.exists() else b""
        if len(log) != self._known[0]:  # a waiting test asks often, and mostly nothing is new
            self._known = len(log), [json.loads(one) for one in log.splitlines() if one.endswith(b"}")]
        return self._known[1]

    def notes(self, kind: str) -> list[dict[str, Any]]:
        notes = (one["details"] for one in self.events() if one["event"] == "note")
        return [one["details"] for one in notes if one["event"] == kind]

    def phases(self) -> list[str]:
        """Those of the agent's life, in order."""
        return [one["after"] for one in self.notes("lifecycle")]

    def end(self) -> tuple[int, str]:
        message, _ = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, message


def asked(what: str, state: Path) -> None:
    """As the operator asks it, in a terminal."""
    assert main([what, "--state", str(state)]) == Exit.SUCCESS


@pytest.mark.parametrize("seed", [4, pytest.param(3, marks=pytest.mark.deep)])
def test_after_any_kill_the_task_ends_and_nothing_is_done_twice_or_lost(seed: int) -> None:
    modules = premises().configuration.modules
    trial = trial_of(seed, "symbolic", modules, 0.8, WHERE, "make dumplings", longest=PATIENCE)
    assert trial.violations == []
    assert set(trial.kills) <= set(VICTIMS)


def test_an_agent_that_keeps_crashing_is_left_in_quarantine_and_released(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    watched = Watched.paused(tmp_path, "--max-crashes", "2")
    first = watched.agent()
    os.kill(first, signal.SIGKILL)
    os.kill(watched.until(lambda: watched.agent(other_than=first)), signal.SIGKILL)
    code, message = watched.end()
    assert code == Exit.REJECTED
    assert "agent quarantined: it crashed 2 times within 600 s; the last time, killed by SIGKILL" in message
    asked("resume", watched.state)
    state = str(watched.state)
    anew = ["run", "make dumplings", "--plant", "symbolic", "--state", state, "--out", str(tmp_path / "anew")]
    assert main(anew) == Exit.REJECTED
    assert "this agent is in quarantine" in capsys.readouterr().err
    assert main(["release", "--state", state]) == Exit.SUCCESS
    assert Quarantine(watched.state).reason() is None
    # The plant has waited, and the task goes on.
    assert main(["run", "--resume", "--state", state]) == Exit.SUCCESS
    log = str(watched.out / "audit.jsonl")
    assert verify_log(Path(log)).is_sound
    capsys.readouterr()
    assert main(["audit", "replay", log, "--ecms", str(ROOT / MODULE)]) == Exit.SUCCESS
    opened = [one["event"] for one in watched.events() if one["event"].startswith("session-")]
    assert opened == ["session-opened", "session-resumed", "session-resumed"]
    assert main(["run", "--resume", "--state", state]) == Exit.REJECTED
    assert "there is nothing to resume" in capsys.readouterr().err


def test_an_interrupt_stops_the_agent_and_starts_no_other(tmp_path: Path) -> None:
    watched = Watched.paused(tmp_path)
    watched.process.send_signal(signal.SIGINT)
    code, message = watched.end()
    assert code == Exit.INTERRUPTED
    assert "crashed" not in message
    assert watched.phases() == ["running", "paused", "running", "stopped"]
    assert not (watched.state / "run.json").exists()


@pytest.mark.deep
def test_a_pause_outlasts_a_crash_and_so_does_a_stop(tmp_path: Path) -> None:
    watched = Watched.paused(tmp_path)
    os.kill(watched.agent(), signal.SIGKILL)
    watched.until(lambda: len(watched.phases()) == 5)
    assert watched.phases() == ["running", "paused", "recovered", "running", "paused"]
    # Nobody is there to hear it but the agent that is started next.
    second = watched.agent()
    os.kill(watched.process.pid, signal.SIGSTOP)
    os.kill(second, signal.SIGKILL)
    asked("stop", watched.state)
    os.kill(watched.process.pid, signal.SIGCONT)
    code, message = watched.end()
    assert code == Exit.REJECTED
    assert "halted: stopped by the operator" in message
    assert message.count("crashed") == 2


def test_an_agent_that_hangs_is_killed_and_the_task_goes_on(tmp_path: Path) -> None:
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "checkpoint.json").write_text("what an earlier task left")
    watched = Watched.paused(tmp_path, "--heartbeat-timeout", "8")
    os.kill(watched.agent(), signal.SIGSTOP)
    asked("resume", watched.state)
    code, message = watched.end()
    assert code == Exit.SUCCESS, message
    assert "no heartbeat for 8 s; killed" in message
    assert verify_log(watched.out / "audit.jsonl").is_sound


def check_that_a_second_is_refused(watched: Watched, capsys: pytest.CaptureFixture[str]) -> None:
    """Check that the refusal of another run says who is there, and for what."""
    state = str(watched.state)
    assert main(["run", "clean the table", "--plant", "symbolic", "--watchdog", "--state", state]) == 1
    message = capsys.readouterr().err
    assert f"has an agent already: pid {watched.process.pid} on " in message
    assert "for “make dumplings”" in message


def test_a_second_is_refused_and_a_task_that_had_ended_before_the_last_crash_is_reported_as_it_ended(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    watched = Watched.paused(tmp_path)
    check_that_a_second_is_refused(watched, capsys)
    # The agent comes to the end, and its watchdog does not hear of it any more.
    os.kill(watched.process.pid, signal.SIGSTOP)
    asked("resume", watched.state)
    watched.until(lambda: not watched.agent())
    ended = watched.notes("run-ended")
    assert [one["reached"] for one in ended] == [True]
    watched.process.kill()
    watched.end()
    records = len(watched.events())
    watched.process = watched.start("--resume")
    code, message = watched.end()
    assert code == Exit.SUCCESS, message
    assert "The task had already ended.\n" in message
    assert "steps      3 run" in message
    # Reading the end signs the log when it is opened and closed, and records nothing else.
    added = watched.events()[records:]
    assert [(one["event"], one["details"].get("closing")) for one in added] == [
        ("checkpoint", False),
        ("checkpoint", True),
    ]
    assert len(watched.notes("run-ended")) == 1
    assert verify_log(watched.out / "audit.jsonl").is_sound
    assert not (watched.state / "run.json").exists()


def test_the_end_of_another_run_is_not_taken_for_that_of_this_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    watched = Watched.killed(tmp_path)
    state = ["--state", str(watched.state)]
    assert main(["run", "make dumplings", "--plant", "symbolic", *state, "--out", str(tmp_path / "o")]) == 0
    capsys.readouterr()
    assert main(["run", "--resume", *state]) == Exit.REJECTED
    watched.kill_plant()
    message = capsys.readouterr().err
    assert "the audit record does not hold the record at which the checkpoint was made" in message


@pytest.mark.deep
def test_an_agent_whose_supervisor_is_gone_leaves_its_task_to_be_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    watched = Watched.killed(tmp_path)
    resume = ["run", "--resume", "--state", str(watched.state)]
    with monkeypatch.context() as alone:
        alone.setenv("NOTIFY_SOCKET", str(tmp_path / "gone"))
        alone.setenv("WATCHDOG_USEC", "1000000")
        assert main(resume) == Exit.REJECTED
    assert (watched.state / "run.json").exists()
    assert main(resume) == Exit.SUCCESS
    assert not (watched.state / "run.json").exists()


@pytest.mark.parametrize("arguments", [[], ["make dumplings", "--resume"]])
def test_an_instruction_or_resume_and_not_both(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", *arguments, "--state", str(tmp_path)]) == Exit.USAGE
    assert "give an instruction, --task NAME or --goal, or --resume without them" in capsys.readouterr().err


@pytest.mark.parametrize("more", [["--bag", "bag"], ["--mcap", "run.mcap"], ["--live"]])
def test_a_recording_or_live_view_does_not_go_with_a_watchdog(
    more: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["run", "make dumplings", "--watchdog", "--state", str(tmp_path), *more]
    assert main(asked) == Exit.USAGE
    assert "cannot be combined with --watchdog" in capsys.readouterr().err


@pytest.mark.parametrize("port", ["70000", "-1", "a"])
def test_a_port_that_is_none_is_refused(
    port: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["run", "make dumplings", "--state", str(tmp_path), f"--live={port}"])
    assert "expected a port from 0 to 65535" in capsys.readouterr().err


@pytest.mark.deep
def test_without_its_plant_a_task_ends_and_is_not_resumed_on_another(tmp_path: Path) -> None:
    # With ticks, over a second of computing lies between the end of the first step and that of the task.
    watched = Watched(tmp_path, "--plant", "kinematic")
    watched.until(lambda: watched.notes("step-ended"))
    watched.kill_plant()
    code, message = watched.end()
    assert code == Exit.REJECTED, message
    assert "the plant has ended" in message
    watched.process = watched.start("--resume")
    code, message = watched.end()
    assert code == Exit.REJECTED
    assert "it is another plant" in message, message


def test_a_plant_that_cannot_be_opened_is_reported_at_once(tmp_path: Path) -> None:
    code, message = Watched(tmp_path, "--faults", "wrapper_bumped").end()
    assert code == Exit.REJECTED
    assert "the plant has ended: aeros: `--faults` needs `--plant physics`" in message


def test_without_its_plant_the_task_is_reported_as_one_to_start_again(tmp_path: Path) -> None:
    path = tmp_path / "plant.sock"
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(path))
    with pytest.raises(PlantSetupError, match="start the task again"):
        connect_plant(path)

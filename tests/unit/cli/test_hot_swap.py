"""Another terminal changes what is installed while `aeros run` is at work: processes, as a user has them."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from tests.repo.tree import ROOT

_PATIENCE = 60.0  # s


class Robot:
    """A robot's folder, a run on it that is paused at its first action, and terminals beside it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.out = folder / "out"
        shutil.copytree(ROOT / "ecms" / "make_dumplings", folder / "make_dumplings")
        for command in ("install ./make_dumplings", "configure make_dumplings", "activate make_dumplings"):
            self.terminal(command)

    def terminal(self, command: str) -> str:
        """A command of this process, which is another than the run's."""
        with chdir(self.folder), redirect_stdout(StringIO()) as message:
            assert main([*command.split(), "--state", "state"]) == 0, message.getvalue()
        return message.getvalue()

    def begin(self) -> subprocess.Popen[str]:
        """A run that waits at its first action."""
        self.terminal("pause")
        run = [sys.executable, "-m", "aeros", "run", "make dumplings", "--plant", "symbolic"]
        running = subprocess.Popen(
            [*run, "--state", "state", "--out", "out"],
            cwd=self.folder,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        latest = time.monotonic() + _PATIENCE
        while not any(one["event"] == "paused" for one in self.records()):
            assert running.poll() is None, running.communicate()[0]
            assert time.monotonic() < latest
            time.sleep(0.05)
        return running

    def records(self) -> list[dict[str, Any]]:
        log = self.out / "audit.jsonl"
        lines = log.read_text().splitlines(keepends=True) if log.exists() else []
        return [json.loads(line) for line in lines if line.endswith("\n")]

    def rewrite(self, name: str, old: str, new: str) -> None:
        path = self.folder / "make_dumplings" / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot(tmp_path)


@pytest.fixture
def running(robot: Robot) -> Iterator[subprocess.Popen[str]]:
    process = robot.begin()
    yield process
    process.kill()
    process.communicate()


def speeds(records: list[dict[str, Any]]) -> set[float]:
    moves = [one["details"]["asked"] for one in records if one["event"] == "decision"]
    return {one["parameters"]["speed"] for one in moves if one["kind"] == "move_tool"}


def test_an_upgrade_takes_over_in_the_middle_of_a_run(robot: Robot, running: subprocess.Popen[str]) -> None:
    robot.rewrite("ecm.yaml", "version: 1.0.0", "version: 1.1.0")
    robot.rewrite("skills.py", 'pace = inputs["hand_speed"]', "pace = 0.12")
    assert "1.1.0 is active" in robot.terminal("install ./make_dumplings")
    robot.terminal("resume")
    message, _ = running.communicate(timeout=_PATIENCE)
    assert running.returncode == 0, message
    records = robot.records()
    changed = next(n for n, one in enumerate(records) if one["event"] == "configuration-changed")
    assert records[changed]["details"]["modules"]["make_dumplings"]["version"] == "1.1.0"
    # The step that was under way was of the old code, and none of its actions was executed any more.
    assert 0.45 not in speeds(records)
    assert 0.12 in speeds(records[changed:])
    # And all of it is decided the same again, also when nothing of it is installed any more.
    decisions = [one for one in records if one["event"] == "decision"]
    for command in ("deactivate make_dumplings", "remove make_dumplings"):
        robot.terminal(command)
    message = robot.terminal("audit replay out/audit.jsonl")
    assert message == f"{len(decisions)} decisions reproduced; 0 differ\n"


def test_a_module_withdrawn_in_the_middle_of_a_run_acts_no_more(
    robot: Robot, running: subprocess.Popen[str]
) -> None:
    robot.terminal("deactivate make_dumplings")
    robot.terminal("resume")
    message, _ = running.communicate(timeout=_PATIENCE)
    assert running.returncode == 1, message
    assert "revoked" in message
    assert not [one for one in robot.records() if one["event"] == "decision"]
    assert [one["event"] for one in robot.records()].count("step-ended") == 1

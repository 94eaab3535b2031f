"""`aeros top` says how a run is, on a terminal and elsewhere, and leaves the terminal as it was."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

from aeros.cli.latest_run import save_latest_run
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.audit.log import verify_log
from tests.unit.apps.report_page.left_runs import decision, run_symbolic, written_run

ENTER, LEAVE = b"\x1b[?1049h\x1b[?25l", b"\x1b[?25h\x1b[?1049l"


def test_it_says_how_the_latest_run_of_this_robot_ended(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = run_symbolic(tmp_path)
    capsys.readouterr()
    state = ["--state", str(tmp_path / "state")]
    assert main(["top", *state]) == Exit.SUCCESS
    message = capsys.readouterr().out
    allowed = verify_log(out / "audit.jsonl").decisions.allowed
    for words in (
        "make_dumplings.make_dumplings  1",
        " s  goal reached\n",
        f"{allowed} allowed, 0 attenuated, 0 denied   quota grip-rate",
        "/60",
        "✓ make_dumplings.boil",
        "ALLOW     make_dumplings.boil",
        "make_dumplings.dumpling_cooked",
    ):
        assert words in message
    assert main(["top", *state, "--once", "--format", "json"]) == Exit.SUCCESS
    view = json.loads(capsys.readouterr().out)
    assert (view["schema"], view["folder"]) == ("aeros/top/1", str(out))
    assert view["ended"] == {"reached": True, "reason": None, "skipped": False}
    assert view["is_running"] is False


def test_where_nothing_was_run_it_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["top", "--state", str(tmp_path)]) == Exit.REJECTED
    assert "no runs found" in capsys.readouterr().err


def test_a_run_whose_process_is_gone_is_not_listed_as_running(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = written_run(tmp_path / "out", [("decision", decision(1.0))])
    assert main(["top", "--run", str(out), "--state", str(tmp_path)]) == Exit.SUCCESS
    assert "process ended without recording an end" in capsys.readouterr().out


def test_text_of_a_module_does_not_control_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hostile = "x\x1b[2J\x1b]0;owned\x07\r\n"
    denied = decision(1.0, "DENY", hostile, reasons=[["AE750", hostile, hostile]])
    trace = [{"time": 0.0, "kind": "plan-accepted", "text": hostile, "details": {"steps": [hostile]}}]
    out = written_run(tmp_path / "out", [("decision", denied)], trace)
    assert main(["top", "--run", str(out), "--state", str(tmp_path)]) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "\\x1b[2J" in message
    assert not {"\x1b", "\x07", "\r"} & set(message)


def _read_until(master: int, wanted: bytes, patience: float = 60.0) -> bytes:
    read, latest = b"", time.monotonic() + patience
    while wanted not in read and time.monotonic() < latest:
        if select.select([master], [], [], 0.1)[0]:
            try:
                read += os.read(master, 65536)
            except OSError:
                break
    return read


@pytest.mark.parametrize("how", ["ctrl-c", "terminate", "hang up"])
def test_however_it_is_left_the_terminal_is_whole(how: str, tmp_path: Path) -> None:
    out = written_run(tmp_path / "out", [("decision", decision(1.0))])
    save_latest_run(tmp_path, out)
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    with subprocess.Popen(
        [sys.executable, "-m", "aeros.cli.main", "top", "--state", str(tmp_path)],
        stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
        preexec_fn=lambda: __import__("fcntl").ioctl(0, termios.TIOCSCTTY, 0),
    ) as top:  # fmt: skip
        message = _read_until(master, b"1 allowed")
        assert message.startswith(ENTER)
        if how == "ctrl-c":
            os.write(master, b"\x03")
        else:
            top.send_signal(signal.SIGTERM if how == "terminate" else signal.SIGHUP)
        left = _read_until(master, LEAVE)
        assert LEAVE in left
        assert b"Traceback" not in left
        assert top.wait(30) == Exit.SUCCESS
    assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)


def test_elsewhere_than_on_a_terminal_it_follows_to_the_end(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "aeros.cli.main", "run", "make dumplings", "--plant", "symbolic",
         "--state", str(tmp_path / "state"), "--out", str(tmp_path / "out"), "--seed", "7"],
        stdout=subprocess.DEVNULL,
    ) as run:  # fmt: skip
        latest = time.monotonic() + 60
        while not (tmp_path / "state" / "latest-run.json").exists() and time.monotonic() < latest:
            time.sleep(0.01)
        ended = subprocess.run(
            [sys.executable, "-m", "aeros.cli.main", "top", "--state", str(tmp_path / "state"),
             "--format", "json", "--interval", "0.05"],
            capture_output=True, text=True, timeout=60, check=True,
        )  # fmt: skip
        assert run.wait(60) == Exit.SUCCESS
    views = [json.loads(line) for line in ended.stdout.splitlines()]
    times = [view["time"] for view in views]
    assert times == sorted(times)
    assert views[-1]["is_running"] is False

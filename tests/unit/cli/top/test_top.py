"""`aeros top` says how a run is, on a terminal and elsewhere, and leaves the terminal as it was."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Mapping
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


class Terminal:
    """`aeros top` on a terminal of its own."""

    def __init__(self, state: Path, rows: int = 24, variables: Mapping[str, str] | None = None) -> None:
        self.master, self.slave = pty.openpty()
        self.resize(rows, 100)
        self.before = termios.tcgetattr(self.slave)
        kept = {
            key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "COLUMNS", "LINES")
        }
        self.process = subprocess.Popen(
            [sys.executable, "-m", "aeros.cli.main", "top", "--state", str(state), "--interval", "0.1"],
            stdin=self.slave, stdout=self.slave, stderr=self.slave, start_new_session=True,
            env={**kept, "TERM": "xterm", **(variables or {})},
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )  # fmt: skip

    def resize(self, rows: int, columns: int) -> None:
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def press(self, keys: bytes) -> None:
        os.write(self.master, keys)

    def read_until(self, wanted: bytes) -> bytes:
        return _read_until(self.master, wanted)

    def screen_with(self, wanted: bytes) -> list[bytes]:
        """The lines of the first whole screen that shows something."""
        read, latest = b"", time.monotonic() + 60.0
        while time.monotonic() < latest:
            read += _read_until(self.master, b"\x1b[J")
            *_, frame, _ = read.split(b"\x1b[J")
            lines = frame.rpartition(b"\x1b[H")[2].split(b"\r\n")
            if any(wanted in line for line in lines):
                return lines
        raise AssertionError(read[-2000:])

    def leave(self) -> None:
        """Wait until it has left the terminal as it was."""
        left = _read_until(self.master, LEAVE)
        assert LEAVE in left
        assert b"Traceback" not in left
        assert self.process.wait(30) == Exit.SUCCESS
        assert termios.tcgetattr(self.slave) == self.before
        os.close(self.master)
        os.close(self.slave)


def denied_run(tmp_path: Path) -> Path:
    denied = decision(1.0, "DENY", reasons=[["AE750", "some-rule", "person at 0.61 m"]])
    out = written_run(tmp_path / "out", [("decision", denied)])
    save_latest_run(tmp_path, out)
    return tmp_path


@pytest.mark.parametrize("how", ["ctrl-c", "terminate", "hang up", "q"])
def test_however_it_is_left_the_terminal_is_whole(how: str, tmp_path: Path) -> None:
    terminal = Terminal(denied_run(tmp_path))
    assert terminal.read_until(b"1 denied").startswith(ENTER)
    if how in ("ctrl-c", "q"):
        terminal.press(b"\x03" if how == "ctrl-c" else b"q")
    else:
        terminal.process.send_signal(signal.SIGTERM if how == "terminate" else signal.SIGHUP)
    terminal.leave()


@pytest.mark.parametrize("variables", [{}, {"NO_COLOR": "1"}])
def test_a_denial_is_red_unless_colours_are_switched_off(tmp_path: Path, variables: dict[str, str]) -> None:
    terminal = Terminal(denied_run(tmp_path), variables=variables)
    (line,) = [one for one in terminal.screen_with(b"some-rule") if b"some-rule" in one]
    assert line.startswith(b"\x1b[1;31m") is not bool(variables)
    terminal.press(b"q")
    terminal.leave()


def test_a_small_terminal_is_scrolled_and_a_larger_one_shows_more(tmp_path: Path) -> None:
    terminal = Terminal(denied_run(tmp_path), rows=5)
    lines = terminal.screen_with(b"more below")
    assert len(lines) == 4
    assert b"no task yet" in lines[0]
    terminal.press(b"\x1b[F")  # End
    lines = terminal.screen_with(b"more above")
    assert not any(b"no task yet" in one for one in lines)
    terminal.press(b"\x1b[H")  # Home
    terminal.screen_with(b"no task yet")
    terminal.resize(40, 60)
    lines = terminal.screen_with(b"q quit")
    latest = time.monotonic() + 30.0
    while len(lines) != 39:
        assert time.monotonic() < latest
        lines = terminal.screen_with(b"q quit")
    assert all(len(one.decode()) < 60 + 20 for one in lines)
    terminal.press(b"q")
    terminal.leave()


def test_keys_give_no_command_if_nothing_runs(tmp_path: Path) -> None:
    record = denied_run(tmp_path) / "latest-run.json"
    record.write_text(json.dumps({**json.loads(record.read_text()), "pid": 0}))
    terminal = Terminal(tmp_path)
    terminal.screen_with(b"q quit")
    terminal.press(b"p")
    terminal.screen_with(b"pause: no run of this robot is under way here")
    terminal.press(b"s")
    terminal.screen_with(b"stop all motion and end the run?")
    terminal.press(b"y")
    terminal.screen_with(b"stop: no run of this robot is under way here")
    terminal.press(b"q")
    terminal.leave()
    assert not (tmp_path / "registry").exists()


@pytest.mark.slow
def test_keys_pause_and_stop_a_run(tmp_path: Path) -> None:
    state = tmp_path / "state"
    with subprocess.Popen(
        [sys.executable, "-m", "aeros.cli.main", "run", "make dumplings", "--plant", "kinematic",
         "--state", str(state), "--out", str(tmp_path / "out"), "--seed", "7"],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as run:  # fmt: skip
        latest = time.monotonic() + 60
        while not (state / "latest-run.json").exists():
            assert time.monotonic() < latest
            time.sleep(0.01)
        terminal = Terminal(state)
        terminal.screen_with(b"  runs")
        terminal.press(b"p")
        terminal.screen_with(b"paused: no action starts until `aeros resume`")
        terminal.press(b"s")
        terminal.screen_with(b"stop all motion and end the run?")
        terminal.press(b"n")
        terminal.screen_with(b"not stopped")
        assert run.poll() is None
        terminal.press(b"s")
        terminal.screen_with(b"stop all motion and end the run?")
        terminal.press(b"y")
        terminal.screen_with(b"goal not reached")
        assert run.wait(60) != Exit.SUCCESS
        terminal.press(b"q")
        terminal.leave()


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

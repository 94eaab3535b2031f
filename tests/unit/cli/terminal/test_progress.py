"""Progress: after two seconds, on a terminal of standard error alone, erased before anything is written."""

from __future__ import annotations

import io
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

import pytest

from aeros.cli.terminal.progress import ProgressLine
from aeros.cli.terminal.streams import safe_streams

SEQUENCE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Terminal(io.StringIO):
    """A terminal that shows all that was written to it."""

    def isatty(self) -> bool:
        return True

    def wait_for(self, text: str) -> None:
        end = time.monotonic() + 10.0
        while text not in self.getvalue():
            assert time.monotonic() < end, self.getvalue()
            time.sleep(0.01)


@contextmanager
def terminal_of_errors() -> Iterator[Terminal]:
    """Let standard error be a terminal, and standard output none."""
    shown = Terminal()
    with (
        patch.dict(os.environ, {"TERM": "xterm", "COLUMNS": "60"}),
        patch.object(sys, "stderr", shown),
        patch.object(sys, "stdout", io.StringIO()),
        safe_streams(),
    ):
        yield shown


def test_nothing_is_shown_of_what_is_done_soon() -> None:
    with terminal_of_errors() as terminal:
        line = ProgressLine()
        line.show("proving a")
        line.end()
        sys.stdout.write("result\n")
        assert terminal.getvalue() == ""


def test_work_that_goes_on_is_shown_without_another_call() -> None:
    with terminal_of_errors() as terminal:
        line = ProgressLine(delay=0.05)
        line.show("proving [red]a[/] :smile: \x1b[2J\nforged")
        terminal.wait_for("proving [red]a[/] :smile: \\u001b[2J forged")
        line.end()
        assert max(map(len, SEQUENCE.sub("", terminal.getvalue()).split("\n"))) <= 60 * 8


def test_it_is_erased_before_a_result_and_shown_again() -> None:
    with terminal_of_errors() as terminal:
        line = ProgressLine(10, delay=0.0)
        line.show("trials", 3)
        terminal.wait_for("3/10")
        sys.stdout.write("result\n")
        shown = terminal.getvalue()
        # Up to its line, and that line erased.
        assert shown.endswith("\r\x1b[1A\x1b[2K")
        sys.stdout.write("result\n")
        assert terminal.getvalue() == shown
        line.show("trials", 4)
        terminal.wait_for("4/10")
        line.end()
        line.end()
        line.show("trials", 5)
        assert terminal.getvalue().endswith("\r\x1b[1A\x1b[2K")
        assert "5/10" not in terminal.getvalue()
        # A program that is killed while it shows progress leaves the cursor visible.
        assert "\x1b[?25l" not in terminal.getvalue()


def test_another_progress_takes_its_place() -> None:
    with terminal_of_errors() as terminal:
        first = ProgressLine(delay=0.0)
        first.show("first")
        terminal.wait_for("first")
        second = ProgressLine(delay=0.0)
        second.show("second")
        terminal.wait_for("second")
        first.show("first again")
        second.end()
        assert "first again" not in terminal.getvalue()


def test_a_forked_process_writes_though_progress_was_being_drawn() -> None:
    with terminal_of_errors() as terminal:
        line = ProgressLine(delay=0.0)
        line.show("proving")
        terminal.wait_for("proving")
        is_held, is_over = threading.Event(), threading.Event()

        def hold() -> None:
            with line.lock:
                is_held.set()
                is_over.wait()

        holder = threading.Thread(target=hold)
        holder.start()
        is_held.wait()
        shown = terminal.getvalue()
        child = os.fork()
        if child == 0:
            signal.alarm(5)  # ends it with a signal if it waits for the lock
            sys.stderr.write("of the child\n")
            os._exit(0 if terminal.getvalue() == f"{shown}of the child\n" else 1)
        _, status = os.waitpid(child, 0)
        is_over.set()
        holder.join()
        line.end()
    assert os.waitstatus_to_exitcode(status) == 0


@pytest.mark.parametrize(("is_terminal", "name"), [(False, "xterm"), (True, "dumb")])
def test_it_is_for_terminals_with_control_sequences_alone(
    is_terminal: bool, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: is_terminal)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", name)
    line = ProgressLine(3, delay=0.0)
    line.show("trials", 1)
    line.end()
    assert stream.getvalue() == ""

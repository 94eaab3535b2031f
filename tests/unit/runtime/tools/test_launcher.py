"""The launcher runs one program, ends with its code, and ends everything that the program started."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.tools import confinement as module
from aeros.runtime.tools.confinement import ConfinedCommand, confine
from aeros.runtime.tools.launcher import NOT_CONFINED
from aeros.spec.model.policy import IsolationPolicy
from tests.unit.runtime.tools.services import PYTHON, python

WARNING = IsolationPolicy(refuses_missing=False)


@pytest.fixture
def mark(tmp_path: Path) -> Path:
    """A file that a program may write."""
    return tmp_path / "mark"


@pytest.fixture
def launched(mark: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Starts the launcher of a program; the plan may be changed."""
    started: list[subprocess.Popen[bytes]] = []
    launch = module._launch

    def start(body: str, **changes: Any) -> tuple[subprocess.Popen[bytes], ConfinedCommand]:
        monkeypatch.setattr(module, "_launch", lambda plan: launch(json.dumps(json.loads(plan) | changes)))
        confinement = replace(PYTHON, writes=(str(mark.parent),))
        confined = opened.enter_context(confine(python(body), confinement, WARNING, 20.0))
        started.append(
            subprocess.Popen(
                confined.arguments,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={},
                start_new_session=True,
            )
        )
        return started[-1], confined

    with ExitStack() as opened:
        yield start
        for process in started:
            process.terminate()
            process.wait(20.0)
            for pipe in (process.stdin, process.stdout):
                assert pipe is not None
                pipe.close()


@pytest.mark.parametrize(("body", "code"), [("pass", 0), ("sys.exit(7)", 7), ("os.abort()", 134)])
def test_it_ends_with_the_code_of_the_program(launched: Any, body: str, code: int) -> None:
    process, _ = launched(body)
    assert process.wait(20.0) == code


def test_input_and_output_are_the_programs_alone(launched: Any) -> None:
    process, _ = launched("print(sys.stdin.read(), end='', flush=True); os.close(1); time.sleep(60)")
    process.stdin.write(b"question")
    process.stdin.close()
    assert process.stdout.read() == b"question"  # ends when the program closes it, although that goes on
    assert process.poll() is None


def test_a_signal_ends_it_with_all_that_it_started(launched: Any, mark: Path) -> None:
    body = f"""
if os.fork() == 0:
    os.setsid()
while True:
    open({str(mark)!r}, 'a').write('x')
    time.sleep(0.02)
"""
    process, _ = launched(body)
    while not mark.exists():
        time.sleep(0.01)
    process.terminate()
    process.wait(20.0)
    written = mark.stat().st_size
    time.sleep(0.3)
    assert mark.stat().st_size == written


def test_without_its_runtime_it_starts_nothing(launched: Any, mark: Path) -> None:
    process, _ = launched(f"open({str(mark)!r}, 'w')", parent=os.getpid() + 1)
    assert process.wait(20.0) == 1
    assert not mark.exists()


@pytest.mark.parametrize(
    ("path", "reason"),
    [("/no/such/folder", "does not exist"), ("/dev/null/below", "cannot be opened: Not a directory")],
)
def test_a_path_that_cannot_be_opened_is_no_missing_layer(
    launched: Any, mark: Path, path: str, reason: str
) -> None:
    process, confined = launched(f"open({str(mark)!r}, 'w')", reads=[path])
    assert process.wait(20.0) == NOT_CONFINED
    assert confined.describe("it ended") == f"it cannot be confined: {path} {reason}"
    assert not mark.exists()


def test_a_program_that_cannot_be_confined_is_not_started(launched: Any, mark: Path) -> None:
    changes = {"entrances": ["/no/such/group"], "required": ["cgroups"]}
    process, confined = launched(f"open({str(mark)!r}, 'w')", **changes)
    assert process.wait(20.0) == NOT_CONFINED
    expected = "it cannot be confined: cgroups: [Errno 2] No such file or directory: '/no/such/group'"
    assert confined.describe("it ended") == expected
    assert not mark.exists()

"""A command whose output nobody reads any more ends quietly, whatever it was doing."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from aeros.exit_codes import Exit
from aeros.runtime.audit.check import verify_log
from aeros.runtime.audit.log import AuditLog

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "audit.jsonl"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fdatasync", lambda file: None)
        with AuditLog(path) as opened:
            for number in range(300):
                opened.append("note", {"event": "x" * 100, "number": number})
    return path


@pytest.mark.parametrize(
    "command",
    [
        ("audit", "show", "LOG"),
        ("audit", "show", "LOG", "--format", "json"),
        ("audit", "verify", "LOG"),
        ("--help",),
        ("audit", "--help"),
        ("explain", "AE403"),
        ("schema", "site"),
        ("graph", "ecms/make_dumplings"),
        ("list",),
    ],
)
def test_a_closed_pipe_ends_a_command_without_a_word(command: tuple[str, ...], log: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    given = [str(log) if word == "LOG" else word for word in command]
    try:
        ended = subprocess.run(
            [sys.executable, "-m", "aeros.cli.main", *given],
            stdout=writer,
            stderr=subprocess.PIPE,
            cwd=REPOSITORY,
            text=True,
            check=False,
        )
    finally:
        os.close(writer)
    assert ended.stderr == ""
    # argparse itself passes over an error while it prints help.
    assert ended.returncode == (Exit.SUCCESS if "--help" in command else Exit.CLOSED_PIPE)


def test_a_watch_that_cannot_write_does_not_make_the_log_unsound(log: Path) -> None:
    def look(*_: object) -> None:
        raise OSError("no space left where the output goes")

    with pytest.raises(OSError, match="no space left"):
        verify_log(log, look)

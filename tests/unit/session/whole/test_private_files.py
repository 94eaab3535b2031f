"""Files of a run are readable by their owner alone, also under a umask that shares everything."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

import aeros
from aeros.cli.main import main
from aeros.exit_codes import Exit

REPOSITORY = Path(__file__).parents[4]


@pytest.fixture(autouse=True)
def _sharing() -> Iterator[None]:
    before = os.umask(0)
    yield
    os.umask(before)


def shared(folder: Path) -> list[str]:
    """The files and folders there, itself included, that others could use; sockets and links left out."""
    found = [folder, *folder.rglob("*")]
    assert len(found) > 1
    return [
        f"{one}: {stat.S_IMODE(one.lstat().st_mode):o}"
        for one in found
        if one.lstat().st_mode & 0o077 and (one.is_dir() or one.is_file())
    ]


def run(folder: Path, *options: str) -> int:
    return main(
        ["run", "make dumplings", "--plant", "symbolic", "--ecms", str(REPOSITORY / "ecms"),
         "--state", str(folder / "state"), "--out", str(folder / "out"), *options]
    )  # fmt: skip


def test_a_run_shares_nothing(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()  # a folder of the user's, which was shared
    assert run(tmp_path, "--report") == Exit.SUCCESS
    assert {"trace.jsonl", "measured.jsonl", "audit.jsonl", "report.html"} <= {
        one.name for one in (tmp_path / "out").iterdir()
    }
    assert shared(tmp_path / "out") == []
    # The public key is for everybody who can reach its folder.
    assert shared(tmp_path / "state") in ([], [f"{tmp_path / 'state' / 'audit.key.pub'}: 644"])


def test_files_that_were_shared_become_private_when_they_are_continued(tmp_path: Path) -> None:
    assert run(tmp_path) == Exit.SUCCESS
    for one in (tmp_path / "state").rglob("*"):
        one.chmod(0o755 if one.is_dir() else 0o600 if one.name == "audit.key" else 0o644)
    (tmp_path / "out").rename(tmp_path / "before")
    assert run(tmp_path) == Exit.SUCCESS
    continued = ("memory.sqlite3", "checkpoint.json", "latest-run.json", "phase.json")
    assert not [one for one in shared(tmp_path / "state") if any(name in one for name in continued)]


def test_a_session_of_a_program_shares_nothing(tmp_path: Path) -> None:
    with aeros.open_session(REPOSITORY / "ecms", out=tmp_path / "out", state=tmp_path / "state") as session:
        assert session.run("make dumplings").reached
    assert shared(tmp_path / "out") == []
    assert shared(tmp_path / "state") in ([], [f"{tmp_path / 'state' / 'audit.key.pub'}: 644"])

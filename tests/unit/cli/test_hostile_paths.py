"""No file that a path names can make a command fail as a bug, wait for ever, or print a traceback."""

from __future__ import annotations

import argparse
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from aeros.cli.arguments import existing_path
from aeros.cli.commands import COMMANDS
from aeros.cli.main import main
from aeros.cli.parsers import command_parser
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT

MODULE = str(ROOT / "ecms" / "serve_table")
NEEDED = {
    "code": "AE501",
    "ecm": MODULE,
    "instruction": "prepare the table for the guests",
    "module": MODULE,
    "name": "tidy",
    "new": MODULE,
    "old": MODULE,
    "experiments": "list",
}
"""Values of arguments that a command needs beside the hostile one."""

SKIPPED = ("policy", "install", "configure", "activate", "mcp", "serve", "demo")
"""Commands that change a robot or serve; their paths are of the kinds that other commands have too."""


def paths_of(
    parser: argparse.ArgumentParser, words: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield command lines that end where a path goes, and the name of that argument."""
    for one in parser._actions:
        if isinstance(one, argparse._SubParsersAction):
            for name, inner in one.choices.items():
                yield from paths_of(inner, (*words, name))
        if one.type is not existing_path:
            continue
        others = [
            other
            for other in parser._actions
            if other is not one and (other.required or not other.option_strings) and other.dest in NEEDED
        ]
        line = list(words)
        for other in others:
            line += [*other.option_strings[-1:], NEEDED[other.dest]]
        yield (*line, *one.option_strings[-1:]), one.dest


LINES = [
    line for name in COMMANDS if name not in SKIPPED for line, _ in paths_of(command_parser(name), (name,))
]


@pytest.fixture
def hostile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").touch()
    (tmp_path / "binary").write_bytes(bytes(range(256)) * 9)
    (tmp_path / "latin1").write_bytes("schema: 1\nname: caf\xe9\n".encode("latin1"))
    (tmp_path / "list").write_bytes(b"- a\n- b\n")
    (tmp_path / "lines").write_bytes(b'null\n[]\n{"a": 1}\n')
    (tmp_path / "folder" / "ecm.yaml").mkdir(parents=True)
    (tmp_path / "folder" / "audit.jsonl").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "zero").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    return sorted(tmp_path.iterdir())


def _too_long(*_: object) -> None:
    raise AssertionError("it waits for ever")


@pytest.mark.deep
@pytest.mark.parametrize("line", LINES, ids=" ".join)
def test_a_hostile_path_is_refused_in_words(
    line: tuple[str, ...], hostile: list[Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert len(LINES) > 50
    former = signal.signal(signal.SIGALRM, _too_long)
    try:
        for path in hostile:
            signal.alarm(60)
            try:
                code: object = main([*line, str(path)])
            except SystemExit as end:  # of argparse
                code = end.code
            shown = capsys.readouterr()
            assert code in {Exit.SUCCESS, Exit.REJECTED, Exit.USAGE, Exit.UNDECIDED}, (path, shown)
            assert "Traceback" not in shown.out + shown.err
            assert code == Exit.SUCCESS or shown.out + shown.err, path
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, former)

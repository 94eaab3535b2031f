"""Text of a hostile skill never reaches a terminal as it is, whatever command shows it."""

from __future__ import annotations

import argparse
import io
import json
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from aeros.cli.commands import COMMANDS as ALL_COMMANDS
from aeros.cli.main import main
from aeros.cli.parsers import command_parser
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.characters import is_hidden

REPOSITORY = Path(__file__).parents[3]
ESCAPES = r"\x1b[2J\x1b]0;title\x07\nforged: goal reached\rclean_table: goal reached\x9b1m\u202e\u2066\u200b"
ASKING = f'''
    yield act("look", camera="" + "{ESCAPES}")
'''
HOSTILE = ESCAPES.encode().decode("unicode_escape")
RAISING = f'''
    observed = yield act("look", camera="over" + "head")
    raise ValueError("{ESCAPES}\\ngoal       reached\\n")
'''
DRIVING = RAISING.replace('act("look", camera="over" + "head")', 'act("wait", duration=0.1)')


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of a module whose every skill fails with, or asks for, hostile text."""
    folder = tmp_path_factory.mktemp("hostile")
    module = folder / "ecms" / "clean_table"
    shutil.copytree(REPOSITORY / "ecms" / "clean_table", module)
    lines = (module / "skills.py").read_text(encoding="utf-8").splitlines(keepends=True)
    code, is_public = [], False
    for line in lines:
        starts = line.startswith("def ")
        is_public = not line.startswith("def _") if starts else is_public and line[:1] in " \n"
        code += [] if is_public and not starts else [line]
        if is_public and starts:
            others = DRIVING if line.startswith("def dock") else RAISING
            code.append(ASKING if line.startswith("def recover") else others)
    (module / "skills.py").write_text("".join(code), encoding="utf-8")
    assert main(["verify", str(module), "--no-cache"]) == Exit.SUCCESS
    return folder


def run(folder: Path) -> list[str]:
    return ["run", "clean the table", "--ecms", f"{folder}/ecms", "--plant", "symbolic", "--seed", "1",
            "--state", f"{folder}/state", "--out", f"{folder}/out"]  # fmt: skip


COMMANDS = [
    "why {out}",
    "why {out} --format json",
    "audit show {out}/audit.jsonl",
    "audit show {out}/audit.jsonl --format json",
    "audit verify {out}/audit.jsonl",
    "audit replay {out}/audit.jsonl",
    "report {out}",
    "top --run {out} --once",
    "top --run {out} --once --format json",
    "memory show --state {state}",
    "memory show --state {state} --skill {hostile}",
    "memory search --state {state} goal",
    "memory search --state {state} goal --format json",
    "memory export --state {state}",
    "list --state {state}",
    "verify {ecms} --no-lock",
    "verify {ecms} --no-lock --format json",
    "graph {ecms}/clean_table",
    "predict {ecms}/clean_table",
    "explain {hostile}",
    "run {hostile} --ecms {ecms} --state {state}",
    "plan {hostile} --ecms {ecms}",
    "why {hostile}",
    "no-command {hostile}",
    "verify {hostile}",
    "approve --state {state} {hostile}",
]


def forged(text: str) -> bool:
    """Check if a line of `HOSTILE` stands where a message of AEROS would begin."""
    return any(line.startswith("forged") for line in text.split("\n"))


def hidden(text: str) -> Iterator[str]:
    return (one for one in text if one not in "\n\t" and is_hidden(one))


def test_no_command_writes_a_hidden_character(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(run(folder)) == Exit.REJECTED
    shown = capfd.readouterr()
    assert "\\x1b[2J" in shown.out
    assert not list(hidden(shown.out + shown.err))
    assert "goal       reached" not in shown.out.splitlines()  # no line of its own
    assert not forged(shown.out + shown.err)
    names = {"out": f"{folder}/out", "state": f"{folder}/state", "ecms": f"{folder}/ecms", "hostile": HOSTILE}
    seen = 0
    for command in COMMANDS:
        with suppress(SystemExit):  # the parser of arguments ends by it
            main([word.format(**names) for word in command.split()])
        shown = capfd.readouterr()
        text = shown.out + shown.err
        assert text, command
        assert "Traceback" not in text, command
        assert "this is a bug in aeros" not in text, command
        assert not list(hidden(text)), command
        assert not forged(text), command
        seen += "1b[2J" in text
    assert seen >= 12
    assert not list(hidden((folder / "out" / "report.html").read_text(encoding="utf-8")))


def test_a_request_with_hostile_text_is_denied_in_plain_text(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    request = json.dumps({"kind": HOSTILE, "parameters": {HOSTILE: HOSTILE}})
    for form in ("text", "json"):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(f"{request}\n{HOSTILE}\n".encode())))
        main(
            [
                "decide",
                "--ecm",
                f"{folder}/ecms/clean_table",
                "--skill",
                "wipe",
                "--format",
                form,
                "--explain",
            ]
        )
        shown = capfd.readouterr()
        assert not list(hidden(shown.out + shown.err))


def commands() -> Iterator[tuple[list[str], argparse.ArgumentParser]]:
    """Yield every command and subcommand with its parser."""
    for name in ALL_COMMANDS:
        parser = command_parser(name)
        inner = subparsers(parser)
        yield from (([name, word], one) for word, one in inner.items()) if inner else [([name], parser)]


def subparsers(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    found = [one for one in parser._actions if isinstance(one, argparse._SubParsersAction)]
    return dict(found[0].choices) if found else {}


def command_line(
    words: list[str], parser: argparse.ArgumentParser, hostile: argparse.Action, given: dict[str, str]
) -> list[str]:
    """Return a command whose every needed argument is harmless but one."""
    line = list(words)
    for one in parser._actions:
        value = HOSTILE if one is hostile else given.get(one.dest, next(iter(one.choices or ["x"])))
        if one.option_strings:
            if one is hostile or one.required or one.dest in given:
                line += [f"{one.option_strings[-1]}={value}"]
        elif one is hostile or one.nargs not in ("?", "*"):
            line += [value]
    return line


def _sleep_in_other_threads(seconds: float, sleep: Callable[[float], None] = time.sleep) -> None:
    """Threads that other tests left would poll without a pause, which took 40 s of processor time."""
    if threading.current_thread() is not threading.main_thread():
        sleep(seconds)


def test_no_argument_of_any_command_is_written_as_it_is(
    folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.sleep", _sleep_in_other_threads)
    monkeypatch.setattr("aeros.cli.project.demo.best_plant", lambda: "symbolic")
    monkeypatch.setattr("aeros.apps.live_page.page_server.PageServer.serve_forever", lambda _: None)
    monkeypatch.setattr("os.nice", lambda _: 0)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO()))
    (tmp_path / "ecms").mkdir()
    given = dict.fromkeys(("module", "old", "new", "ecm", "paths"), f"{folder}/ecms/clean_table")
    given |= {"ecms": "ecms", "skill": "wipe"}
    tried, shown = 0, 0
    for words, parser in commands():
        for hostile in parser._actions:
            if hostile.nargs == 0 or hostile.dest == argparse.SUPPRESS:
                continue
            line = command_line(words, parser, hostile, given)
            with suppress(SystemExit):
                assert main(line) != Exit.INTERNAL_ERROR, line
            message = capfd.readouterr()
            text = message.out + message.err
            assert "Traceback" not in text, line
            assert not list(hidden(text)), line
            assert not forged(text), line
            tried, shown = tried + 1, shown + ("goal reached" in text)
    assert tried >= 180
    assert shown >= 60

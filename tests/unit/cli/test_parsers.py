"""The command line: help, and errors that name what was probably intended."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import pytest

from aeros.cli.commands import COMMANDS
from aeros.cli.parsers import command_parser, parse
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT
from tests.reports_in_full import compare_with_file

FIELDS = ("dest", "nargs", "const", "default", "required", "metavar", "help")


def ended(words: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[object, str, str]:
    """The exit code, standard output and standard error of a command line that ends the program."""
    with pytest.raises(SystemExit) as end:
        parse(words)
    shown = capsys.readouterr()
    return end.value.code, shown.out, shown.err


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["vverify", "ecms"], "aeros: error: no command `vverify`; did you mean `verify`?"),
        (["xyzzy"], "aeros: error: no command `xyzzy`"),
        (["run", "--sede", "3"], "aeros run: error: unrecognized arguments: --sede; did you mean `--seed`?"),
        (["run", "--colour-of-sky"], "aeros run: error: unrecognized arguments: --colour-of-sky"),
        (
            ["verify", "--formt", "json"],
            "aeros verify: error: unrecognized arguments: --formt; did you mean `--format`?",
        ),
        (["run", "--see=x"], "aeros run: error: argument --seed: expected a whole number from 0 to 2^63 - 1"),
        (["run", "one", "two"], "aeros run: error: unrecognized arguments: two"),
        (["verify", "ecms", "--format", "jsn"], "did you mean `json`?"),
        (["audit", "showw", "x"], "did you mean `show`?"),
        (["run", "one", "--", "--plant"], "aeros run: error: unrecognized arguments: --plant"),
        (["new", "module", "x"], "did you mean `ecm`?"),
        (["audit"], "aeros audit: error: name one of: verify, show, replay, keygen"),
        (["audit", "show", "--limit", "3"], "aeros audit show: error: unrecognized arguments: --limit"),
        (["help", "vverify"], "aeros: there is no command or group `vverify`; did you mean `verify`?"),
    ],
)
def test_an_error_names_what_was_intended(
    words: list[str], error: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, shown = ended(words, capsys)
    assert (code, out) == (Exit.USAGE, "")
    assert any(line.endswith(error) for line in shown.splitlines()), shown
    assert len(shown.splitlines()) <= 3


def test_help_is_of_all_commands_a_group_a_command_or_one_inside_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = {}
    for words in (["help"], ["--help"], ["help", "author"], ["help", "run"], ["help", "audit", "show"]):
        code, shown[" ".join(words)], _ = ended(words, capsys)
        assert code == Exit.SUCCESS
    assert shown["help"] == shown["--help"]
    assert shown["help author"].startswith("author: write modules")
    assert "--heartbeat-timeout SECONDS" in shown["help run"]
    assert "run: run instructions" in shown["help run"]
    assert "aeros audit show" in shown["help audit show"]
    assert ended(["-V"], capsys)[1].startswith("aeros ")
    assert ended(["version"], capsys) == ended(["-V"], capsys)
    assert ended([], capsys) == (Exit.USAGE, shown["help"], "")


def test_a_command_is_parsed_and_called() -> None:
    parsed = parse(["explain", "AE501"])
    assert parsed.code == "AE501"
    assert callable(parsed.command)


def arguments_of(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Write every argument of a command, and of those inside it."""
    yield f"# {parser.prog}"
    for name in ("usage", "description", "epilog"):
        lines = str(getattr(parser, name) or "").strip().splitlines()
        yield from (f"{name}: {line}".rstrip() for line in lines)
    for one in parser._actions:
        inner = one.choices if isinstance(one, argparse._SubParsersAction) else {}
        choices = "" if one.choices is None else f" of {sorted(map(str, one.choices))}"
        kind = "" if one.type is None else f" as {getattr(one.type, '__name__', 'another')}"
        yield f"{type(one).__name__} {' '.join(one.option_strings)}{kind}{choices}"
        values = {name: getattr(one, name) for name in FIELDS if getattr(one, name) not in (None, False)}
        texts = {
            name: str(value).replace(f"{ROOT}/", "") for name, value in values.items() if not callable(value)
        }
        yield from (f"    {name}: {text}" for name, text in texts.items())
        for each in dict.fromkeys(inner.values()):
            yield from arguments_of(each)


def test_every_argument_of_every_command_in_full(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    lines = [line for name in sorted(COMMANDS) for line in arguments_of(command_parser(name))]
    compare_with_file(Path(__file__).with_name("arguments.txt"), "\n".join(lines) + "\n")

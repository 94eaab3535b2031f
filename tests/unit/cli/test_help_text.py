"""Help: it fits on a screen, says the same as the whole help, and every option is in it."""

from __future__ import annotations

import argparse
import re

import pytest

from aeros.cli.commands import COMMANDS, GROUPS
from aeros.cli.help_text import (
    MOST_LINES,
    WrappedEpilog,
    all_commands,
    group_help,
    option_names,
    short_help,
    short_usage,
)
from aeros.cli.parsers import command_parser


@pytest.mark.parametrize("width", [80, 120])
def test_all_help_fits_the_screen(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    texts = {"aeros": all_commands(), **{f"group {name}": group_help(name) for name in GROUPS}}
    texts |= {name: command_parser(name).format_help() for name in COMMANDS}
    assert {name for name, text in texts.items() if text.count("\n") > MOST_LINES} == set()
    texts |= {f"whole {name}": command_parser(name).whole_help() for name in COMMANDS}
    wide = {
        (name, line)
        for name, text in texts.items()
        for line in text.splitlines()
        # What has no space in it, such as a path, cannot be broken.
        if len(line) > width and len(line.split()) > 3
    }
    assert wide == set()


def test_short_help_names_each_option_and_whole_help_explains_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    for name in COMMANDS:
        parser = command_parser(name)
        short, whole = parser.format_help(), parser.whole_help()
        for option in option_names(parser):
            assert re.search(rf"{option}\b", whole), (name, option)
            assert re.search(rf"{option}\b", short) or option == "-o", (name, option)
        assert "examples:\n  aeros " in short, name
        assert "exit codes: 0 proved" in short, name
        described = short.split("options:")[1].split("examples:")[0]
        assert described.count("(") == described.count(")"), name


def test_help_of_all_commands_and_of_groups_names_each_command() -> None:
    for title, group in GROUPS.items():
        shown = group_help(title)
        for name, entry in group.commands.items():
            assert re.search(rf"\b{name}\b", all_commands())
            assert f"  {name}" in shown
            assert entry.summary[:30] in shown


def test_options_are_a_line_each_without_brackets_and_what_follows_a_semicolon() -> None:
    parser = argparse.ArgumentParser(
        prog="aeros try", description="Try.", epilog="examples:\n  aeros try x\n"
    )
    parser.add_argument("thing", nargs="?")
    parser.add_argument("rest", nargs="*", metavar="REST")
    parser.add_argument("--speed", metavar="SPEED", help="greatest speed (default: 2); in m/s")
    parser.add_argument("--hidden", help=argparse.SUPPRESS)
    parser.add_argument("--pair", nargs=2, metavar=("ONE", "OTHER"), help="two")
    parser.add_argument("--kind", choices=("a", "b"), help="100 %% of it")
    assert short_usage(parser) == "usage: aeros try [options] [thing] [REST ...]"
    long = "x\n" * (MOST_LINES + 1)
    shown = short_help(parser, long)
    assert re.search(r"^  --speed SPEED +greatest speed$", shown, re.MULTILINE)
    assert re.search(r"^  --pair ONE +two$", shown, re.MULTILINE)
    assert re.search(r"^  --kind {a,b} +100 % of it$", shown, re.MULTILINE)
    assert "hidden" not in shown
    assert "`aeros help try` explains each option." in shown
    assert short_help(parser, "whole\n") == "whole\n"


def test_lines_that_are_too_wide_are_broken_below_their_beginning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "42")
    parser = argparse.ArgumentParser(
        prog="aeros", epilog="examples:\n  aeros run one two three four five six seven eight",
        formatter_class=WrappedEpilog,
    )  # fmt: skip
    assert parser.format_help().endswith("  aeros run one two three four five six\n      seven eight\n")


def test_a_remark_below_its_example_moves_to_the_left_where_it_is_too_wide() -> None:
    formatter = WrappedEpilog("aeros", width=40)
    text = f"  aeros run --long\n{' ' * 30}a remark that is wide\n{' ' * 30}narrow"
    assert formatter._fill_text(text, 40, "").split("\n") == [
        "  aeros run --long",
        "      a remark that is wide",
        " " * 30 + "narrow",
    ]


def test_a_short_quoted_argument_stays_on_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert '\n      clean_pot.force="6 N"\n' in command_parser("verify").format_help()

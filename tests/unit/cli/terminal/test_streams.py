"""Nothing that a program prints moves a cursor, clears a screen or reorders text, but our own sequences.

Text fits a terminal, and files and other programs get each line whole.
"""

# ruff: noqa: T201  what `print` writes is the matter here

from __future__ import annotations

import io
import json
import sys
from contextlib import AbstractContextManager, nullcontext

import pytest

from aeros.cli.terminal.streams import (
    SafeStream,
    begin_progress,
    escape_for_terminal,
    output_width,
    print_coloured,
    print_data,
    print_line,
    safe_streams,
    screen_width,
    shows_colour,
    write_control,
)

HOSTILE = "a\x1b[2Jb\rc\x9bd\u202ee\x07f\u2028g\U000e0041h\x7f"


@pytest.mark.parametrize("text", ["", "plain\n\ttext\n", "é 日本 😀 ▶ ✓ …"])
def test_plain_text_stays_as_it_is(text: str) -> None:
    assert escape_for_terminal(text) == text


def test_every_hidden_character_becomes_an_escape_that_means_the_same_in_json() -> None:
    escaped = escape_for_terminal(HOSTILE)
    assert escaped.isprintable()
    assert json.loads(f'"{escaped}"') == HOSTILE
    assert escape_for_terminal(escaped) == escaped
    assert escape_for_terminal("a\r\nb") == "a\\u000d\nb"
    assert escape_for_terminal("\ud800") == "\\ud800"


def test_all_output_goes_through_a_safe_stream(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_streams():
        print(HOSTILE)
        print(HOSTILE, file=sys.stderr)
        sys.stdout.writelines(iter([HOSTILE, "\n"]))
        with safe_streams():
            write_control("\x1b[H")
    shown = capsys.readouterr()
    assert shown.out == f"{escape_for_terminal(HOSTILE)}\n" * 2 + "\x1b[H"
    assert shown.err == f"{escape_for_terminal(HOSTILE)}\n"
    print("\x1b", end="")
    assert capsys.readouterr().out == "\x1b"


def test_a_safe_stream_is_otherwise_the_stream_behind_it() -> None:
    behind = io.TextIOWrapper(io.BytesIO(b"a\nb\n"))
    stream = SafeStream(behind)
    assert not stream.isatty()
    assert stream.buffer is behind.buffer
    assert list(stream) == ["a\n", "b\n"]


def test_colours_pass_and_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_streams():
        print_coloured("\x1b[1;31merror\x1b[0m \x1b[2J\x1b]0;title\x07")
    assert capsys.readouterr().out == "\x1b[1;31merror\x1b[0m \\u001b[2J\\u001b]0;title\\u0007\n"


class Progress:
    """Progress that records what happens to it."""

    def __init__(self, happened: list[str]) -> None:
        self.happened = happened
        self.lock: AbstractContextManager[object] = nullcontext()

    def erase(self) -> None:
        self.happened.append("erased")

    def end(self) -> None:
        self.happened.append("ended")


def test_progress_is_erased_before_anything_is_written_and_ends_with_the_command() -> None:
    happened: list[str] = []

    class Stream(io.StringIO):
        def write(self, text: str) -> int:
            happened.append(text)
            return len(text)

    stream = SafeStream(Stream())
    with safe_streams():
        begin_progress(Progress(happened))
        stream.write("result")
        begin_progress(Progress(happened))
        stream.write_data("{}")
    stream.write("later")
    assert happened == ["erased", "result", "ended", "erased", "{}", "ended", "later"]


class Terminal(io.StringIO):
    """A terminal whose width `COLUMNS` says."""

    def isatty(self) -> bool:
        return True


LONG = "one two three four five six seven eight nine ten eleven"


def test_text_is_wrapped_in_a_terminal_and_nowhere_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    wrapped = "one two three four five six seven eight\n  nine ten eleven\n"
    for terminal, text in ((Terminal(), wrapped), (io.StringIO(), f"{LONG}\n")):
        monkeypatch.setattr("sys.stdout", terminal)
        with safe_streams():
            print(LONG)
        assert terminal.getvalue() == text


def test_data_for_programs_is_wrapped_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    terminal = Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    data = json.dumps({"text": HOSTILE, "long": LONG})
    with safe_streams():
        print_data(data)
        print_data("\x1b[2J", end="", flush=True)
    print_data("as it is")
    assert terminal.getvalue() == f"{data}\n\\u001b[2Jas it is\n"


def test_text_that_goes_on_on_a_line_is_wrapped_with_what_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    terminal = Terminal()
    stream = SafeStream(terminal)
    stream.write("a question that goes on: ")
    stream.write("yes or perhaps no")
    stream.write("\n")
    stream.write("x" * 40)
    stream.write(" y\n")
    assert terminal.getvalue() == f"a question that goes on: yes or perhaps\n  no\n{'x' * 40}\n  y\n"


def test_sequences_that_are_no_colours_of_ours_are_escaped(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_streams():
        print_coloured("\x1b[1;31mred\x1b[0m \x1b[8mhidden \x1b[7mreversed \x1b[41mon red \x1b[38;5;1mother")
    shown = (
        "\x1b[1;31mred\x1b[0m \\u001b[8mhidden \\u001b[7mreversed \\u001b[41mon red \\u001b[38;5;1mother\n"
    )
    assert capsys.readouterr().out == shown


def test_colours_do_not_count_and_go_on_on_the_next_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    terminal = Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    with safe_streams():
        print_coloured(f"\x1b[31m{'red ' * 10}\x1b[0m[bold]:smile:[/] \x1b[2J")
    assert terminal.getvalue() == (f"\x1b[31m{'red ' * 9}red\x1b[0m\n  [bold]:smile:[/] \\u001b[2J\n")


def test_the_width_is_that_of_the_environment_or_of_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "132")
    assert screen_width(Terminal()) == output_width(Terminal()) == 132
    assert output_width(io.StringIO()) is None
    for given, columns in (("7", 40), ("", 80), ("0", 80), ("wide", 80)):
        monkeypatch.setenv("COLUMNS", given)
        assert screen_width(io.StringIO()) == columns


@pytest.mark.parametrize(
    ("environment", "is_terminal", "coloured"),
    [
        ({}, True, True),
        ({}, False, False),
        ({"TERM": "dumb"}, True, False),
        ({"NO_COLOR": "1"}, True, False),
        ({"NO_COLOR": ""}, True, True),
        ({"FORCE_COLOR": "1"}, False, True),
        ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, True, False),
    ],
)
def test_colours_are_for_terminals_unless_the_environment_decides(
    environment: dict[str, str], is_terminal: bool, coloured: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Stream(io.StringIO):
        def isatty(self) -> bool:
            return is_terminal

    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert shows_colour(Stream()) is coloured
    assert shows_colour(Stream(), "always")
    assert not shows_colour(Stream(), "never")


def test_a_message_has_one_line_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_streams():
        print("aeros: `a\nforged\n\nforged`", file=sys.stderr)
        print("\naeros: after an empty line\n", file=sys.stderr)
        print("a\nb")
        print_line("a\nb")
    shown = capsys.readouterr()
    message = "aeros: `a\n  forged\n\n  forged`\n\naeros: after an empty line\n\n"
    assert shown.err == message
    assert shown.out == "a\nb\na\\nb\n"

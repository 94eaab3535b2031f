"""Nothing that a program prints moves a cursor, clears a screen or reorders text, but our own sequences."""

# ruff: noqa: T201  what `print` writes is the matter here

from __future__ import annotations

import io
import json
import sys

import pytest

from aeros.cli.terminal import (
    SafeStream,
    escape_for_terminal,
    print_coloured,
    print_diagnostics,
    print_line,
    safe_streams,
    show_progress,
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


def test_progress_stays_on_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_streams():
        show_progress("half\n\x1b[2J")
        show_progress("done", is_last=True)
    assert capsys.readouterr().err == "\r\x1b[Khalf \\u001b[2J\r\r\x1b[K\r\x1b[Kdone\n"


def test_progress_is_erased_before_anything_else_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_streams():
        show_progress("half")
        print("result")
        print("another")
    shown = capsys.readouterr()
    assert shown.err == "\r\x1b[Khalf\r\r\x1b[K"
    assert shown.out == "result\nanother\n"


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
        print_diagnostics("error: one\n  |\n\nhelp: two")
        print("a\nb")
        print_line("a\nb")
    shown = capsys.readouterr()
    message = (
        "aeros: `a\n  forged\n\n  forged`\n\naeros: after an empty line\n\nerror: one\n  |\n\nhelp: two\n"
    )
    assert shown.err == message
    assert shown.out == "a\nb\na\\nb\n"

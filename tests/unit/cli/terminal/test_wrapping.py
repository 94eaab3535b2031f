"""Lines that are wider than a terminal are wrapped below their text."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from aeros.cli.terminal.wrapping import ansi_line, drawn_lines, line_starts, rich_text, wrap_line
from tests.hypothesis_profiles import examples

LONG = "one two three four five six seven eight nine ten"


@pytest.mark.parametrize(
    ("line", "wrapped"),
    [
        ("short", ["short"]),
        (LONG, ["one two three four five six seven eight", "  nine ten"]),
        (f"goal   {LONG}", ["goal   one two three four five six seven", "       eight nine ten"]),
        (f"  a: {LONG}", ["  a: one two three four five six seven", "    eight nine ten"]),
        (f"note: {LONG}", ["note: one two three four five six seven", "      eight nine ten"]),
        (f"{'x' * 30}  {LONG}", ["x" * 30 + "  one two", "  three four five six seven eight nine", "  ten"]),
        ("餃子 " * 9 + "餃", ["餃子 餃子 餃子 餃子 餃子 餃子 餃子 餃子", "  餃子 餃"]),
        (f"see {'/a' * 25} now", ["see", f"  {'/a' * 25}", "  now"]),
        ("100\u00a0mm " * 5 + "endings", ["100\u00a0mm " * 4 + "100\u00a0mm", "  endings"]),
        ("[red]" + "x" * 50 + "[/] y", ["[red]" + "x" * 50 + "[/]", "  y"]),
        ("a\tb" + " c" * 30, ["a       b" + " c" * 15, "        " + "c " * 14 + "c"]),
    ],
)
def test_a_line_is_wrapped_below_its_text_and_words_stay_whole(line: str, wrapped: list[str]) -> None:
    assert wrap_line(line, 40).split("\n") == wrapped


def test_a_line_that_is_begun_already_is_wrapped_in_what_is_left_of_it() -> None:
    assert wrap_line("five six seven", 40, start=30).split("\n") == ["five six", "  seven"]
    assert wrap_line("fourteen-letters", 40, start=30).split("\n") == ["", "  fourteen-letters"]
    assert wrap_line(" five six", 40, start=38).split("\n") == ["", "  five six"]


def test_offsets_of_further_lines() -> None:
    assert line_starts("aa bb  cc", 5, 5) == [7]
    assert line_starts("aa bb  cc", 5, 2) == [7]
    assert line_starts("aa bb  cc", 2, 2) == [3, 7]
    assert line_starts("  aaaaaa bb", 4, 4) == [9]
    assert line_starts("", 4, 4) == []


TEXTS = st.text(st.sampled_from("ab 餃é\u0301🥟❤\ufe0f[]/:*"), max_size=60)


@examples(100)
@given(TEXTS, st.integers(40, 50), st.integers(0, 39))
def test_wrapped_lines_fit_and_lose_no_word(text: str, width: int, start: int) -> None:
    lines = wrap_line(text, width, start).split("\n")
    assert "\n".join(lines).split() == text.split()
    for place, line in enumerate(lines):
        room = width - (0 if place else start)
        assert cell_len(line) <= room or len(line.split()) <= 1


def test_a_line_with_colours_is_the_same_line_again() -> None:
    line = "\x1b[1;31merror\x1b[0m [red]x[/] :smile: 12"
    assert ansi_line(rich_text(line)) == line
    assert ansi_line(rich_text("[red]x[/] :smile: 12")) == "[red]x[/] :smile: 12"
    assert drawn_lines(rich_text(line), 40, is_coloured=False) == ["error [red]x[/] :smile: 12"]

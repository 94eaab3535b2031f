"""Tables, wrapped lines, Markdown and colours: within the width, and never another's text as markup."""

from __future__ import annotations

import io
import re
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from aeros.cli.terminal.rendering import (
    markdown_text,
    number_text,
    paint,
    painter,
    print_diagnostics,
    print_labelled,
    print_table,
    table_lines,
)
from aeros.cli.terminal.streams import escape_for_terminal, safe_streams
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import Source
from tests.hypothesis_profiles import examples

LONG = "one two three four five six seven eight nine ten"
SGR = re.compile(r"\x1b\[([0-9;]*)m")


TEXTS = st.text(st.sampled_from("ab 餃é\u0301🥟❤\ufe0f[]/:*"), max_size=60)
ROWS = [("clean_table", "proved", LONG), ("餃子", "rejected", "[red]x[/] :smile: 0.5 'a'")]


def test_columns_stand_below_each_other_and_the_last_one_is_wrapped() -> None:
    assert table_lines(ROWS, width=None, indent=2) == [
        f"  clean_table  proved    {LONG}",
        "  餃子         rejected  [red]x[/] :smile: 0.5 'a'",
    ]
    assert table_lines(ROWS, width=60) == [
        "clean_table  proved    one two three four five six seven",
        "                       eight nine ten",
        "餃子         rejected  [red]x[/] :smile: 0.5 'a'",
    ]


def test_a_table_too_wide_for_its_columns_has_each_row_below_its_name() -> None:
    assert table_lines(ROWS, width=40, indent=1) == [
        " clean_table",
        "     proved  one two three four five six",
        "             seven eight nine ten",
        " 餃子",
        "     rejected  [red]x[/] :smile: 0.5 'a'",
    ]


def test_numbers_to_the_right_and_least_widths() -> None:
    rows = [("a", "5", "x"), ("b", "12", "y")]
    assert table_lines(rows, width=80, right=(1,)) == ["a   5  x", "b  12  y"]
    assert table_lines(rows, width=80, least=(3,)) == ["a    5   x", "b    12  y"]
    assert table_lines([], width=80) == []


def test_text_of_others_in_a_table_is_escaped_and_only_roles_colour_it() -> None:
    rows = [("a\x1b[2J\nforged", ("good", "good"), "\x1b[8mhidden\x1b[0m")]
    last = "\\u001b[8mhidden\\u001b[0m"
    assert table_lines(rows, width=80) == [f"a\\u001b[2J\\nforged  good  {last}"]
    assert table_lines(rows, width=80, paint=paint) == [f"a\\u001b[2J\\nforged  \x1b[32mgood\x1b[0m  {last}"]


def test_each_line_of_a_coloured_cell_is_coloured() -> None:
    red, plain = "\x1b[1;31m", "\x1b[0m"
    assert table_lines([("name", (LONG, "bad"))], width=40, paint=paint) == [
        f"name  {red}one two three four five six seven{plain}",
        f"      {red}eight nine ten{plain}",
    ]


def test_a_path_too_long_for_its_column_is_whole_below_the_name() -> None:
    path = f"{'/folder' * 12}/:"
    assert table_lines([("output", f"{path} audit.jsonl"), ("why", "x")], width=80) == [
        "output",
        f"    {path}",
        "      audit.jsonl",
        "why     x",
    ]


def test_a_row_without_text_is_an_empty_line() -> None:
    assert table_lines([("a", "b"), ("", "")], width=None) == ["a  b", ""]


def test_a_labelled_line_shows_no_control_sequence_of_a_path(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_streams():
        print_labelled("output", "out/\x1b[8mx\x1b[31m[red]y[/]")
    assert capsys.readouterr().out == "output     out/\\u001b[8mx\\u001b[31m[red]y[/]\n"


CELLS = st.lists(st.tuples(TEXTS, TEXTS, TEXTS), min_size=1, max_size=4)


@examples(60)
@given(CELLS, st.integers(40, 120))
def test_no_line_of_a_table_is_wider_than_the_terminal(rows: list[tuple[str, str, str]], width: int) -> None:
    lines = table_lines(rows, width=width, indent=2)
    wide = [line for line in lines if cell_len(line) > width and len(line.split()) > 1]
    assert wide == []
    texts = escape_for_terminal("".join(cell for row in rows for cell in row))
    assert sorted("".join("".join(lines).split())) == sorted("".join(texts.split()))


def test_a_table_is_printed_at_the_width_of_standard_output(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    with safe_streams():
        print_table(ROWS)
        print_table([])
    assert capsys.readouterr().out.splitlines() == table_lines(ROWS, width=None)
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, "isatty", lambda: True)
    monkeypatch.setattr("sys.stdout", terminal)
    with safe_streams():
        print_table(ROWS)
    assert terminal.getvalue().splitlines() == table_lines(ROWS, width=40)


PAGE = f"""# Title

A **strong** `code` [word](page.md): {LONG}.

```yaml
kept: as    it is
```

- one
- [red]two[/] :smile: \x1b[2J

| a | b |
|---|---|
| 1 | 2 |
"""


def test_a_page_is_drawn_within_the_width_without_boxes_and_markup() -> None:
    shown = markdown_text(PAGE, 40, colour=False)
    assert "\x1b" not in shown
    assert all(cell_len(line) <= 40 for line in shown.split("\n"))
    assert shown.startswith("Title\n\nA strong code word")
    assert "\n    kept: as    it is\n" in shown
    assert "[red]two[/] :smile: \\u001b[2J" in shown


def test_colours_are_standard_ones_without_backgrounds() -> None:
    roles = ("error", "warning", "note", "help", "gutter", "secondary", "good", "bad")
    texts = [*(paint("text", role) for role in roles), markdown_text(PAGE, 80, colour=True)]
    codes = {code for text in texts for found in SGR.findall(text) for code in found.split(";") if code}
    # Boldness and the like, and the eight colours: 38 and 48, backgrounds and bright colours are others.
    assert codes <= {"0", "1", "2", "3", "4", *(str(30 + colour) for colour in range(8)), "39"}


def test_a_stream_without_colours_gets_no_painter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    assert painter(io.StringIO()) is None
    always = painter(io.StringIO(), "always")
    assert always is not None
    assert always("x", "error") == "\x1b[1;31mx\x1b[0m"


def test_diagnostics_fit_the_terminal_of_standard_error(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, "isatty", lambda: True)
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("COLUMNS", "44")
    monkeypatch.setenv("NO_COLOR", "1")
    source = Source("a.yaml", "  move: target in tabletop and speed <= 250 mm/s and never too near")
    place = SpanLabel(source.span(31, 48), "faster than what the rule permits there")
    found = Diagnostic("AE501", "an action that the envelope allows breaks a rule", place, notes=(LONG,))
    with safe_streams():
        print_diagnostics([found])
        sys.stderr.write("next\n")
    assert terminal.getvalue().splitlines() == [
        "error[AE501] invariant-violated: an action",
        "  that the envelope allows breaks a rule",
        " --> a.yaml:1:32",
        "1 | …etop and speed <= 250 mm/s and never t…",
        "  |           ^^^^^^^^^^^^^^^^^",
        "  |           faster than what the rule",
        "  |           permits there",
        "note: one two three four five six seven",
        "      eight nine ten",
        "",
        "next",
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.20000000000000001, "0.2"),
        (1.0, "1"),
        (3.29816376024958, "3.29816"),
        (1.87315504049917e-07, "1.87316e-07"),
        (0.999999812684496, "0.999999812684496"),
    ],
)
def test_a_number_is_rounded_but_no_probability_to_one(value: float, text: str) -> None:
    assert number_text(value) == text

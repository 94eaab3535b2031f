"""Texts over several lines move as a whole."""

from __future__ import annotations

import pytest

from aeros.spec.text.layout.scalars import lay_out_block_text, lay_out_flow_text
from tests.unit.spec.text.reading import value_of


@pytest.mark.parametrize(
    ("text", "header", "lines"),
    [
        ("a: |\n      b\n        c\n\n", "|", ("  b", "    c")),
        ("a: >-   # why\n  b\n\n\n  c", ">- # why", ("  b", "", "", "  c")),
        ("a: |2-\n    b\n   c\n", "|2-", ("    b", "   c")),
        ("a: |+\n b\n\n", "|+", ("  b", "")),
        ("a: |\n b\n  \n", "|", ("  b", "   ")),
        ("a: |\n", "|", ()),
    ],
)
def test_a_block_text_keeps_its_inner_indentation(text: str, header: str, lines: tuple[str, ...]) -> None:
    block = lay_out_block_text(text, value_of(text), 0, 0)
    assert (block.header, block.lines) == (header, lines)


@pytest.mark.parametrize(("signs", "is_kept"), [("|", True), (">+", True), ("|-", False)])
def test_no_line_break_is_added_where_it_would_count(signs: str, is_kept: bool) -> None:
    text = f"a: {signs}\n  b"
    assert lay_out_block_text(text, value_of(text), 0, 0).keeps_end is is_kept
    assert not lay_out_block_text(f"{text}\n", value_of(f"{text}\n"), 0, 0).keeps_end


def test_a_text_over_several_lines_is_indented() -> None:
    assert lay_out_flow_text(value_of("a: one  \n      two\n\n three"), 2) == ["one", "  two", "", "  three"]
    assert lay_out_flow_text(value_of('a: "one \\ \n  two \\\n  three"'), 4) == [
        '"one \\ ',
        "    two \\",
        '    three"',
    ]

"""Blocks of Markdown: headings, tables, figures, and their document."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.experiments.report.figures import ReportFigure
from aeros.experiments.report.markdown import OFF, Block, as_markdown, figure_block, heading, mark, table


@pytest.mark.parametrize(("level", "text"), [(1, "# A b"), (3, "### A b")])
def test_a_heading_has_as_many_signs_as_its_level(level: int, text: str) -> None:
    assert heading(level, "A b") == Block(text)


def test_a_table_has_a_head_a_line_and_rows() -> None:
    assert table(("a", ""), [("1", "2"), ("x|y", "")], "more") == Block(
        "| a |  |\n|---|---|\n| 1 | 2 |\n| x\\|y |  |", "more"
    )
    assert table(("a",), []) == Block("| a |\n|---|")


@given(st.lists(st.lists(st.text("ab| ", max_size=4), min_size=2, max_size=2), max_size=3))
def test_no_text_makes_another_column(rows: list[list[str]]) -> None:
    for line in table(("a", "b"), rows).markdown.splitlines():
        assert line.replace("\\|", "").count("|") == 3


def test_a_figure_is_named_in_its_folder() -> None:
    figure = ReportFigure("experiment-4", "made up", {})
    block = figure_block(figure, "figures")
    assert block.markdown == "![made up](figures/experiment-4.svg)"
    assert block.figure is figure


def test_only_what_is_outside_is_marked() -> None:
    assert mark("1.0", True) == f"1.0 {OFF}" == "1.0 ▲"
    assert mark("1.0", False) == "1.0"


def test_blocks_are_joined_and_collapsed_ones_have_a_summary() -> None:
    blocks = [heading(1, "T"), Block("p"), Block("| a |", "all <2>")]
    assert as_markdown(blocks) == (
        "# T\n\np\n\n<details><summary>all &lt;2&gt;</summary>\n\n| a |\n\n</details>\n"
    )
    assert as_markdown([]) == "\n"

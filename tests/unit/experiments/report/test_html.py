"""The page of a document: figures inline, text escaped, and nothing that is loaded."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("jinja2", reason="needs `pip install '.[experiments]'`")
pytest.importorskip("markdown_it", reason="needs `pip install '.[experiments]'`")

from aeros.experiments.report.figures import ReportFigure
from aeros.experiments.report.html import as_html
from aeros.experiments.report.markdown import Block, heading, table
from tests.hypothesis_profiles import examples


def body(*blocks: Block, title: str = "t") -> str:
    page = as_html(blocks, title)
    return page[page.index("<body>") + 6 : page.index("</body>")].strip()


def test_the_page_forbids_everything_but_its_own_style() -> None:
    page = as_html([], "a <b>")
    assert page.startswith('<!DOCTYPE html><html lang="en">')
    assert "default-src 'none'; style-src 'unsafe-inline'" in page
    assert "<title>a &lt;b&gt;</title>" in page
    assert body() == ""


def test_blocks_are_markdown_with_tables() -> None:
    assert body(heading(2, "A"), Block("one *two* `x`")) == (
        "<h2>A</h2>\n<p>one <em>two</em> <code>x</code></p>"
    )
    found = body(table(("a", "b"), [("1", "x|y")]))
    assert "<th>a</th>" in found
    assert "<td>x|y</td>" in found


def test_a_collapsed_block_has_a_summary() -> None:
    found = body(Block("p", "all <2>"))
    assert found.startswith("<details><summary>all &lt;2&gt;</summary>")
    assert found.endswith("<p>p</p>\n</details>")


def test_a_marked_value_stands_out() -> None:
    assert body(Block("1.0 ▲")) == '<p>1.0 <b class="off">▲</b></p>'


def test_a_figure_is_inline_in_place_of_its_reference() -> None:
    figure = ReportFigure("f", "made up", {})
    figure.__dict__["svg"] = "<svg>drawn</svg>"
    assert body(Block("![made up](figures/f.svg)", figure=figure)) == "<svg>drawn</svg>"


@pytest.mark.parametrize(
    "text",
    [
        "<script>alert(1)</script>",
        "[c](https://example.org)",
        "![d](e.png)",
        "<https://f.org>",
        "[g]\n\n[g]: https://h.org",
    ],
)
def test_text_makes_no_link_image_or_html(text: str) -> None:
    assert not re.search(r"<(script|a|img)\b", body(Block(text)))


@examples(15)
@given(st.text(alphabet='<>[]()!"&:/ab\n', max_size=20))
def test_no_text_makes_the_page_load_anything(text: str) -> None:
    assert not re.search(r"<(script|a|img|link|iframe)\b", body(Block(text)))

"""Columns that text takes in a terminal."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.cli.text_width import cell_width, cut_to_width, pad_to_width
from tests.hypothesis_profiles import examples


@pytest.mark.parametrize(
    ("text", "columns"),
    [("", 0), ("plan", 4), ("餃子", 4), ("🥟 done", 7), ("e\u0301", 1), ("Ａ", 2), ("a\u200db", 2), ("é", 1)],
)
def test_wide_characters_take_two_columns_and_joined_ones_none(text: str, columns: int) -> None:
    assert cell_width(text) == columns


@pytest.mark.parametrize(
    ("text", "columns", "cut"),
    [("餃子", 3, "餃"), ("餃子", 4, "餃子"), ("plan", 0, ""), ("ae\u0301b", 2, "ae\u0301"), ("🥟", 1, "")],
)
def test_text_is_cut_between_characters(text: str, columns: int, cut: str) -> None:
    assert cut_to_width(text, columns) == cut


@examples(30)
@given(st.text(max_size=20), st.integers(0, 30))
def test_text_that_is_cut_and_padded_has_the_width(text: str, columns: int) -> None:
    cut = cut_to_width(text, columns)
    assert text.startswith(cut)
    assert cell_width(cut) <= columns
    assert cell_width(pad_to_width(cut, columns)) == columns

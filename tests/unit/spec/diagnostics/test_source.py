from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import Source, SourceSpan


def test_lines_and_columns_count_characters_from_one() -> None:
    source = Source("a.yaml", "é: x\n日本: y\n")
    assert source.position(0) == (1, 1)
    assert source.position(4) == (1, 5)
    assert source.position(5) == (2, 1)
    assert source.position(9) == (2, 5)
    assert source.position(11) == (3, 1)
    assert source.line_text(2) == "日本: y"
    assert source.line_count == 3


def test_only_a_line_feed_ends_a_line_and_a_carriage_return_before_it_is_not_shown() -> None:
    source = Source("a.yaml", "a\u2028b\x85c\rd\r\ne")
    assert source.line_count == 2
    assert source.line_text(1) == "a\u2028b\x85c\rd"


@given(st.text(alphabet="ab\n\r\u2028"), st.data())
def test_position_and_line_start_are_inverse(text: str, data: st.DataObject) -> None:
    source = Source("a", text)
    offset = data.draw(st.integers(0, len(text)))
    line, column = source.position(offset)
    assert source.line_start(line) + column - 1 == offset
    assert text[:offset].count("\n") == line - 1


def test_a_span_knows_both_its_ends() -> None:
    span = Source("a.yaml", "one\ntwo three\n").span(8, 14)
    assert (span.text, span.line, span.column, span.end_line, span.end_column) == ("three\n", 2, 5, 3, 1)
    assert str(span) == "a.yaml:2:5"


def test_spans_compare_by_position_and_cover_each_other() -> None:
    source = Source("a.yaml", "0123456789")
    first, second = source.span(1, 3), source.span(5, 8)
    assert first < second
    assert first.merge(second) == second.merge(first) == source.span(1, 8)
    assert "0123456789" not in repr(first)


def test_a_span_outside_its_source_or_across_two_is_misuse() -> None:
    source = Source("a.yaml", "abc")
    for start, end in ((0, 4), (-1, 2), (2, 1)):
        with pytest.raises(MisuseError):
            SourceSpan(source, start, end)
    with pytest.raises(MisuseError):
        source.span(0, 1).merge(Source("b.yaml", "abc").span(0, 1))
    with pytest.raises(MisuseError):
        source.line_text(2)
    with pytest.raises(MisuseError):
        source.position(4)

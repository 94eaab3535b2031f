"""Comments and blank lines between two values."""

from __future__ import annotations

from aeros.spec.text.layout.gaps import Gap, GapLine, column_origin, read_gap


def test_a_gap_within_a_line_holds_nothing() -> None:
    assert read_gap("a:  b", 2) == Gap("", (), 4, breaks_line=False)


def test_a_comment_behind_a_value_is_apart_from_those_below() -> None:
    text = "a: # one \n\n  #two\nb"
    gap = read_gap(text, 2)
    assert gap == Gap("# one", (GapLine("", 0), GapLine("#two", 2)), text.index("b"), breaks_line=True)
    assert gap.has_comment


def test_the_first_line_of_a_file_is_a_line_of_its_own() -> None:
    gap = read_gap("# one\na", 0)
    assert (gap.trailing, gap.lines) == ("", (GapLine("# one", 0),))
    assert not read_gap("\n\na", 0).has_comment


def test_a_comment_may_end_the_file() -> None:
    assert read_gap("a # one", 1).trailing == "# one"
    gap = read_gap("a\n  # one", 1)
    assert (gap.lines, gap.end) == ((GapLine("# one", 2),), 9)


def test_a_line_begins_after_the_break_before_it() -> None:
    assert [column_origin("ab\ncd", offset) for offset in (0, 2, 3, 5)] == [0, 0, 3, 3]

"""Collections in brackets: on one line, or filled line by line."""

from __future__ import annotations

import pytest

from aeros.spec.text.layout.flow import (
    WIDTH,
    fits,
    is_absent,
    is_in_brackets,
    lay_out,
    move_lines,
    must_stay,
    on_one_line,
)
from aeros.spec.text.nodes import MappingNode, Node, SequenceNode
from tests.unit.spec.text.reading import accepted

Collection = MappingNode | SequenceNode


def collection(text: str) -> Collection:
    """Return the value of the only key."""
    root = accepted(f"a: {text}\n")
    assert isinstance(root, MappingNode)
    value: Node = root.entries[0][1]
    assert isinstance(value, MappingNode | SequenceNode)
    return value


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("{ }", "{}"),
        ("[ a,b ,'c', ]", "[a, b, 'c']"),
        ('{"a":1, b, c: , d : [{}]}', '{"a": 1, b, c, d: [{}]}'),
        ("[a: b, ? c : d]", "[{a: b}, {c: d}]"),
        ("{a:\n\n    b}", "{a: b}"),
    ],
)
def test_a_collection_on_one_line_has_one_space_after_each_sign(text: str, line: str) -> None:
    assert on_one_line(collection(text)) == line


def test_a_comment_or_a_text_over_several_lines_keeps_the_lines() -> None:
    assert must_stay(collection("[a, # b\n  c]"))
    assert must_stay(collection("[a,\n  # b\n  ]"))
    assert must_stay(collection("[a\n  b]"))
    assert not must_stay(collection("[a#b, '# c',\n  {d: e}]"))


def test_lines_that_stay_move_with_their_bracket() -> None:
    kept = collection("[a, # b  \n      c,\n\n ]")
    assert move_lines(kept, 5, 0) == ["[a, # b", "        c,", "", "   ]"]
    assert move_lines(kept, 0, 2) == ["[a, # b", "   c,", "", "  ]"]


def test_a_value_without_room_begins_the_next_line() -> None:
    half = "x" * (WIDTH // 2)
    assert lay_out(collection(f"[{half}, {half}]"), 0, 1, "") == [f"[{half},", f" {half}]"]
    assert lay_out(collection(f"[a, b, {{c: {half}, d: {half}}}, e]"), 0, 1, "") == [
        "[a, b,",
        f" {{c: {half},",
        f"  d: {half}}}, e]",
    ]


def test_a_line_is_as_long_as_the_limit_and_not_longer() -> None:
    longest = "x" * (WIDTH - len("[a, ]"))
    assert lay_out(collection(f"[a, {longest}]"), 0, 1, "") == [f"[a, {longest}]"]
    assert len(lay_out(collection(f"[a, {longest}x]"), 0, 1, "")) == 2
    assert len(lay_out(collection(f"[a, {longest}]"), 1, 2, "")) == 2


def test_a_comment_behind_a_collection_counts_unless_no_line_has_room_for_it() -> None:
    first, last = "x" * 60, "y" * 30
    node = collection(f"[{first}, {last}]")
    assert fits(node, 0, "")
    assert not fits(node, 0, " # " + "c" * 30)
    assert lay_out(node, 0, 1, " # " + "c" * 30) == [f"[{first},", f" {last}]"]
    assert fits(node, 0, " # " + "c" * 100)


def test_one_text_that_is_too_long_stays_behind_its_bracket() -> None:
    long = "x" * WIDTH
    assert lay_out(collection(f"[{long}, a]"), 0, 1, "") == [f"[{long},", " a]"]


def test_block_collections_and_absent_values_are_recognised() -> None:
    assert is_in_brackets(collection("{}"))
    assert not is_in_brackets(collection("\n  - a"))
    root = accepted("a:\nb: ''\n")
    assert isinstance(root, MappingNode)
    assert [is_absent(value) for _, value in root.entries] == [True, False]

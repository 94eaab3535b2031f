"""Edits of a manifest change what they are to change, and nothing else."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.source import Source
from aeros.spec.verification.repairs.manifest_edit import ManifestEditor, quoted

TEXT = """\
# first
a:
  b: 1  # one
  c: [x, y]  # two
  d: {}
list:
  - {k: v, do: w}  # three
  - k: w
    do: z
empty: []
text: "p and q"
"""


def edited(edit: str, *arguments: object, text: str = TEXT) -> str:
    editor = ManifestEditor(Source("ecm.yaml", text))
    node = editor.node(*arguments[0])  # type: ignore[misc]
    fix = getattr(editor, edit)(node, *arguments[1:])
    assert fix is not None
    return editor.applied(fix)


@pytest.mark.parametrize(
    ("edit", "arguments", "old", "new"),
    [
        ("add_entry", (("a",), "e", "2"), "  d: {}\n", "  d: {}\n  e: 2\n"),
        ("add_entry", (("a", "d"), "e", "2"), "d: {}", "d: {e: 2}"),
        ("add_entry", (("list", 0), "e", "x: y"), "do: w}", 'do: w, e: "x: y"}'),
        ("add_entry", (("list", 1), "e", "2"), "    do: z\n", "    do: z\n    e: 2\n"),
        ("remove_entry", (("a",), "b"), "  b: 1  # one\n", ""),
        ("remove_entry", (("a",), "d"), "  d: {}\n", ""),
        ("remove_entry", (("list", 0), "k"), "{k: v, do: w}", "{do: w}"),
        ("remove_entry", (("list", 0), "do"), "{k: v, do: w}", "{k: v}"),
        ("remove_entry", (("list", 1), "do"), "    do: z\n", ""),
        ("remove_item", (("a", "c"), 0), "[x, y]", "[y]"),
        ("remove_item", (("a", "c"), 1), "[x, y]", "[x]"),
        ("remove_item", (("list",), 0), "  - {k: v, do: w}  # three\n", ""),
        ("remove_item", (("list",), 1), "  - k: w\n    do: z\n", ""),
        ("add_list", (("a",), "e", "z"), "  d: {}\n", "  d: {}\n  e: [z]\n"),
        ("add_item", (("a", "c"), "z"), "[x, y]  # two", "[x, y, z]  # two"),
        ("add_item", (("empty",), "z"), "[]", "[z]"),
        ("add_item", (("list",), "z"), "    do: z\n", "    do: z\n  - z\n"),
        ("conjoin", (("text",), "r or s"), '"p and q"', '"p and q and (r or s)"'),
        ("replace", (("a", "b"), "3"), "b: 1  # one", "b: 3  # one"),
    ],
)
def test_an_edit_changes_its_place_alone(
    edit: str, arguments: tuple[object, ...], old: str, new: str
) -> None:
    assert TEXT.count(old) == 1
    assert edited(edit, *arguments) == TEXT.replace(old, new)
    windows = TEXT.replace(old, new).replace("\n", "\r\n")
    assert edited(edit, *arguments, text=TEXT.replace("\n", "\r\n")) == windows


@pytest.mark.parametrize("line_break", ["\n", "\r\n"])
def test_an_item_is_inserted_before_another(line_break: str) -> None:
    editor = ManifestEditor(Source("ecm.yaml", TEXT.replace("\n", line_break)))
    rules, rule = editor.node("list"), editor.node("list", 1)
    assert rule is not None
    fix = editor.insert_item(rules, rule, "{k: u}")
    assert fix is not None
    inserted = TEXT.replace("  - k: w\n", "  - {k: u}\n  - k: w\n")
    assert editor.applied(fix) == inserted.replace("\n", line_break)
    inner = editor.node("a", "c", 0)
    assert inner is not None
    assert editor.insert_item(editor.node("a", "c"), inner, "z") is None  # a list on one line


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("- a: 1\n  # why\n  b: 2\n- c\n", 0),
        ("- c\n- a: 1\n  # why\n  b: 2\n", 1),
        ("[\n  a,  # of a\n  b,  # of b\n]\n", 0),
        ("[\n  a,  # of a\n  b,  # of b\n]\n", 1),
        ("[a,\n  # of b\n  b]\n", 1),
    ],
)
def test_an_item_stays_where_another_comment_would_go_with_it(text: str, number: int) -> None:
    editor = ManifestEditor(Source("ecm.yaml", text))
    assert editor.remove_item(editor.node(), number) is None


@pytest.mark.parametrize("text", ["a:  # all\n  - b\n", "a:\n  # one\n  - b\n", "a: [b,  # b\n]\n"])
def test_a_list_with_comments_is_not_emptied(text: str) -> None:
    editor = ManifestEditor(Source("ecm.yaml", text))
    assert editor.empty_list(editor.node(), "a") is None


def test_an_absent_node_is_not_edited() -> None:
    editor = ManifestEditor(Source("ecm.yaml", TEXT))
    assert editor.node("a", "z") is None
    assert editor.node("list", 5) is None
    assert editor.add_entry(editor.node("a"), "b", "2") is None
    assert editor.add_entry(editor.node("text"), "b", "2") is None
    assert editor.remove_entry(editor.node("a"), "z") is None
    assert editor.remove_entry(editor.node("list"), "k") is None
    assert editor.remove_item(editor.node("a"), 0) is None
    assert editor.remove_item(editor.node("list"), 2) is None
    nested = ManifestEditor(Source("ecm.yaml", "- - 1\n  - 2\n"))
    assert nested.remove_item(nested.node(0), 0) is None  # another list begins on its line
    assert (
        editor.remove_entry(ManifestEditor(Source("ecm.yaml", "a: 1\n")).node(), "a") is None
    )  # nothing would be left
    assert editor.add_item(editor.node("a"), "b") is None
    assert editor.add_list(editor.node("list"), "b", "c") is None
    assert editor.conjoin(editor.node("a"), "p") is None


def test_the_innermost_mapping_at_a_place_is_found() -> None:
    source = Source("ecm.yaml", TEXT)
    editor = ManifestEditor(source)
    place = source.span(TEXT.index("k: w"), TEXT.index("k: w") + 1)
    assert editor.smallest_mapping(editor.node("list"), place, "do") is editor.node("list", 1)
    assert editor.smallest_mapping(editor.node("list"), place, "z") is None
    assert editor.smallest_mapping(editor.node("a"), place, "do") is None


def test_a_text_is_quoted_where_yaml_needs_it() -> None:
    assert quoted("speed <= 1 m/s") == "speed <= 1 m/s"
    assert quoted("tool in {a, b}") == '"tool in {a, b}"'

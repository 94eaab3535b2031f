"""Edits in the file: YAML reads the new text from it, and everything else stays."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.nodes import MappingNode, ScalarNode
from aeros.spec.text.yaml_reader import read_yaml
from aeros.spec.verification.repairs.source_edit import edit_in_source


def scalar_of(text: str) -> ScalarNode:
    root = read_yaml(Source("a.yaml", text), Diagnostics())
    assert isinstance(root, MappingNode), text
    value = next(value for key, value in root.entries if key.text == "wait")
    assert isinstance(value, ScalarNode)
    return value


def edited(text: str, new: str) -> str | None:
    """The file after the edit."""
    scalar = scalar_of(text)
    fix = edit_in_source(scalar.span, scalar.text, new)
    return None if fix is None else text[: fix.span.start] + fix.text + text[fix.span.end :]


@pytest.mark.parametrize(
    ("before", "new", "after"),
    [
        ("wait: x <= 31 s # keep\nb: 1\n", "x <= 30 s", "wait: x <= 30 s # keep\nb: 1\n"),
        ("wait: 'x <= 31 s'\n", "x < 31 s", "wait: 'x < 31 s'\n"),
        ('wait: "x <= 31 s"\n', "x <= 31 s and y", 'wait: "x <= 31 s and y"\n'),
        ("wait: x <= 31 s\n", "x <= 31 s and y in {a, b}", 'wait: "x <= 31 s and y in {a, b}"\n'),
        (
            "wait: >-\n    x <= 31 s\n    and y\nb: 1\n",
            "x <= 30 s and y and z",
            "wait: >-\n    x <= 30 s\n    and y and z\nb: 1\n",
        ),
        ("wait: |\n  x < 3 s\n  or y\n", "(x < 3 s\nor y) and z", "wait: |\n  (x < 3 s\n  or y) and z\n"),
        ("wait: x <= 31 s\n  and y\n", "x <= 31 s and z", "wait: x <= 31 s\n  and z\n"),
    ],
    ids=["comment", "single quotes", "double quotes", "quotes are added", "folded", "literal", "plain lines"],
)
def test_the_rest_of_the_file_stays(before: str, new: str, after: str) -> None:
    assert edited(before, new) == after
    assert scalar_of(after).text.split() == new.split()


def test_an_edit_that_needs_an_escape_is_not_made() -> None:
    assert edited("wait: 'x'\n", "x'") is None
    assert edited('wait: "x"\n', 'x and y == "z"') is None


def test_an_edit_of_a_text_that_is_not_at_its_place_is_not_made() -> None:
    scalar = scalar_of("wait: x and y\n")
    assert edit_in_source(scalar.span, "x and y and more", "x and z") is None


_WORDS = st.lists(st.sampled_from(["x", "31", "<=", "and", "(y)", "2.5 m"]), min_size=1, max_size=6)


@given(_WORDS, _WORDS, st.sampled_from(["wait: {}\n", "wait: '{}'\n", "wait: >-\n   {}\n"]), st.booleans())
def test_yaml_reads_the_new_text_back(old: list[str], new: list[str], form: str, folds: bool) -> None:
    text = form.format(("\n   " if folds else " ").join(old))
    after = edited(text, " ".join(new))
    assert after is not None
    assert scalar_of(after).text.split() == " ".join(new).split()

"""Compositions as YAML, and their insertion into a manifest."""

from __future__ import annotations

import pytest
import yaml

from aeros.apps.trees.composition_text import ManifestConflictError, composition_text, with_composition

PART = {
    "seq": [
        {"check": "not (a) and b"},
        {"seq": [{"skill": "one"}], "retry": 2},
        {
            "if": "c",
            "then": {"any": [{"skill": "two"}, {"tolerate": {"tolerate": {"skill": "three"}}}]},
            "else": {"check": "true"},
        },
        {"skill": "m.four", "id": "four", "inputs": {"by": {"from": "one.w"}, "at": "1 m"}},
    ]
}


def test_the_text_says_what_the_part_is() -> None:
    text = composition_text("tree", 'a "tree"', PART)
    assert yaml.safe_load(text) == {"tree": {"description": 'a "tree"', "do": PART}}


def test_characters_are_written_as_they_are_unless_nobody_sees_them() -> None:
    for description, shown in (
        ("Tür 🤖", '"Tür 🤖"'),
        ("a\u2028b", '"a\\u2028b"'),
        ("\U000e0001", '"\\U000e0001"'),
    ):
        text = composition_text("tree", description, {"skill": "one"})
        assert f"description: {shown}\n" in text
        assert yaml.safe_load(text)["tree"]["description"] == description


@pytest.mark.parametrize(
    ("manifest", "message"),
    [
        ("id: m\ncompositions:\n    old:\n      do: {skill: x}\n", "cannot be added to it; add it by hand"),
        ("id: [m\n", "cannot be read as a manifest"),
        ("- a\n", "cannot be read as a manifest"),
        ("text: |\n  a\n---\nid: m\n", "cannot be read as a manifest"),
        ("{id: m}\n", "cannot be read as a manifest"),
    ],
)
def test_a_manifest_that_could_not_be_read_afterwards_is_left(manifest: str, message: str) -> None:
    with pytest.raises(ManifestConflictError, match=message):
        with_composition(manifest, "tree", composition_text("tree", "t", {"skill": "one"}))


def test_it_is_added_to_the_compositions_of_a_manifest() -> None:
    text = composition_text("tree", "t", {"skill": "one"})
    assert yaml.safe_load(with_composition("id: m", "tree", text))["compositions"].keys() == {"tree"}
    manifest = "id: m\ncompositions: # all\n  old:\n    do: {skill: x}\n\ntasks: {}\n"
    added = with_composition(manifest, "tree", text)
    assert list(yaml.safe_load(added)["compositions"]) == ["tree", "old"]
    assert "compositions: # all\n" in added
    with pytest.raises(ManifestConflictError, match="it has a composition `old`; choose another name"):
        with_composition(manifest, "old", text)
    with pytest.raises(ManifestConflictError, match="write each on lines of its own"):
        with_composition("compositions: {}", "tree", text)

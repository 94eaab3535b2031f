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

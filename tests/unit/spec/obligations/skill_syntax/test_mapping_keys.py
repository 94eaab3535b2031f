"""Keys with which a function asks the mapping that it is given."""

from __future__ import annotations

import pytest

from aeros.spec.obligations.skill_syntax.mapping_keys import (
    missing_keys,
    parameters_of_type,
    unknown_key,
)
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile


def found(body: str, attribute: str | None = None) -> list[str]:
    """The marked keys of a function with this body; its mapping has the key `tall`."""
    file = SkillFile("skills.py", f"def entry(view):\n{body}".encode())
    mistakes = missing_keys(file, file.functions["entry"], "view", ("tall",), "a reading", attribute)
    return [one.primary.span.text for one in mistakes if one.primary is not None]


@pytest.mark.parametrize(
    ("body", "attribute", "marked"),
    [
        ("    return view['tal']\n", None, ["'tal'"]),
        ("    return view.get('tal', 0)\n", None, ["'tal'"]),
        ("    view = yield\n    view['tal']\n", None, ["'tal'"]),
        ("    return view.readings['tal']\n", "readings", ["'tal'"]),
        ("    return view.pictures['tal']\n", "readings", []),
        ("    return view.readings['tal']\n", None, []),
        ("    return view['tall']\n", None, []),
        ("    return view[view]\n", None, []),
        ("    view = {}\n    return view['tal']\n", None, []),
        ("    return [view['tal'] for view in ({},)]\n", None, []),
    ],
)
def test_only_a_key_that_is_certainly_missing_is_marked(
    body: str, attribute: str | None, marked: list[str]
) -> None:
    assert found(body, attribute) == marked


def test_parameters_are_found_by_their_annotation() -> None:
    file = SkillFile("skills.py", b"def entry(a: View, b: int, /, c: View, *, d: View): ...\n")
    assert parameters_of_type(file.functions["entry"], "View") == ["a", "c", "d"]


def test_an_unknown_key_is_told_with_what_there_is() -> None:
    file = SkillFile("skills.py", b"def entry(): ...\n")
    place = file.functions["entry"]
    near = unknown_key(file, place, "tal", ("tall", "wide"), "a reading")
    far = unknown_key(file, place, "q", ("tall", "wide"), "a reading")
    none = unknown_key(file, place, "q", (), "a reading")
    assert [one.help for one in (near, far, none)] == [
        ("did you mean `tall`?",),
        ("there are `tall`, `wide`",),
        ("there are none",),
    ]
    assert near.headline == "`tal` is not a reading"

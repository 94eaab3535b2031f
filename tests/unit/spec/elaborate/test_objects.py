"""Objects of a site: their words, shapes and colours."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.spec.elaborate.faults import messages_of_site

BEFORE = "\nenums:\n"


def messages(tmp_path: Path, kind: str) -> list[str]:
    return messages_of_site(tmp_path, (BEFORE, f"\nobjects:\n  cup: {kind}\n{BEFORE}"))


def test_objects_of_the_reference_site_are_the_members_of_an_enum() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert site.enums["objects"].members == tuple(site.objects)
    can, block = site.objects["red_can"], site.objects["blue_block"]
    assert can.for_perceivers() == {"shape": "cylinder", "size": (0.022, 0.08), "colour": (0.8, 0.1, 0.08)}
    assert (block.shape, block.size) == ("box", (0.04, 0.04, 0.05))
    assert "red can" in can.phrases


@pytest.mark.parametrize(
    ("kind", "found"),
    [
        ("{words: [Cup]}", []),
        ("{words: []}", ["error[AE112] wrong-length: no word asks for `cup`"]),
        ("{words: ['!']}", ["error[AE112] wrong-length: `!` has no word"]),
        (
            "{words: [cup], box: [1 cm, 1 cm]}",
            ["error[AE112] wrong-length: a box has 3 lengths, not 2"],
        ),
        (
            "{words: [cup], box: [1 cm, 1 cm, 1 cm], cylinder: [1 cm, 1 cm]}",
            ["error[AE102] missing-field: `cup` has either `box` or `cylinder`"],
        ),
        (
            "{words: [cup], cylinder: [0 m, 3 m]}",
            ["error[AE111] out-of-bounds: a length is above 0 m and at most 2 m"] * 2,
        ),
        (
            "{words: [cup], colour: [1, 2, 0]}",
            ["error[AE111] out-of-bounds: a colour is red, green and blue, each from 0 to 1"],
        ),
    ],
)
def test_faults_of_an_object(tmp_path: Path, kind: str, found: list[str]) -> None:
    assert messages(tmp_path, kind) == found


def test_an_object_has_a_name_that_nothing_else_has(tmp_path: Path) -> None:
    (message,) = messages_of_site(tmp_path, (BEFORE, f"\nobjects:\n  sponge: {{words: [sponge]}}\n{BEFORE}"))
    assert "`sponge` is already" in message

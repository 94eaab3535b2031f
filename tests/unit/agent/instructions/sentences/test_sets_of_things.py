"""All things of a site are written out one by one, where it is clear which they are."""

from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules


@pytest.mark.parametrize(
    ("text", "fetched"),
    [
        ("bring me both objects", ["red_can", "blue_block"]),
        ("fetch all of the objects and clean the table", ["red_can", "blue_block"]),
        ("bring everything except the block", ["red_can"]),
        ("bring all objects but the can", ["blue_block"]),
        ("put each object on the left", ["red_can to left", "blue_block to left"]),
        ("bring the objects", ["red_can", "blue_block"]),
        ("bring all but the can", ["blue_block"]),
        ("bring every object but the block, then wipe the table", ["red_can"]),
    ],
)
def test_each_thing_is_asked_for_once(text: str, fetched: list[str]) -> None:
    meanings = [one.routed.arguments for one in understand(text, parametric_modules()).errands]
    asked_for = [
        one["object"] + ("" if one["to"] == "anywhere" else f" to {one['to']}")
        for one in meanings
        if "object" in one
    ]
    assert asked_for == fetched


@pytest.mark.parametrize(
    "text",
    [
        "bring everything",
        "bring three objects",
        "bring everything except the beer",
        "if the table is dirty, bring both objects",
        "bring both objects or none",
        "do not bring both objects",
        "bring both objects, not the can",
        "bring some objects",
        "bring both objects, then put it on the left",
        "bring both objects, then put the object on the left",
    ],
)
def test_unclear_sets_are_refused(text: str) -> None:
    with pytest.raises(InstructionError):
        understand(text, parametric_modules())

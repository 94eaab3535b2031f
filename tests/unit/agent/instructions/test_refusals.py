from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.agent.instructions.refusals import AmbiguousInstructionError, InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.dumplings import module, task
from tests.unit.agent.instructions.lists.reference import REGION, parametric_modules


@pytest.mark.parametrize("name", ["can", "which_can"])
@pytest.mark.parametrize("text", ["open the right can", "open the can on the right"])
def test_a_parameter_with_the_name_of_the_object_says_which_one(name: str, text: str) -> None:
    one = replace(REGION, name=name, phrases={"left": ("left",), "right": ("right",)}, default="left")
    opening = replace(
        task("open_can", ("open",), "wrapper_aligned"), object_phrases=("can",), parameters={name: one}
    )
    (found,) = understand(text, {"opener": module("opener", (), opening)}).errands
    assert found.routed.arguments == {name: "right"}
    colour = replace(one, name="colour", phrases={"left": ("red",), "right": ("yellow",)})
    (found,) = understand(
        "open the yellow can",
        {"opener": module("opener", (), replace(opening, parameters={"colour": colour}))},
    ).errands
    assert found.routed.arguments == {"colour": "right"}
    other = replace(opening, parameters={"side": replace(one, name="side")})
    with pytest.raises(InstructionError, match="which one, or where to"):
        understand("open the right can", {"opener": module("opener", (), other)})


def test_an_ambiguity_is_about_all_if_its_part_has_all_words() -> None:
    ambiguous = AmbiguousInstructionError("reason", "clean it", {})
    assert ambiguous.is_about_all("Clean it!")
    assert not ambiguous.is_about_all("clean it, then cook")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("make 3 dumplings", "is out of range: `count` is 1 to 2"),
        ("wipe the left half of the left half", "is a second `region`"),
        ("bring the left can", "`left` may say which one, or where to"),
        ("fetch bob and the can if it rains", "unknown: `bob`"),
        ("we spilled some juice", "asks for nothing"),
    ],
)
def test_a_refusal_says_why(text: str, reason: str) -> None:
    with pytest.raises(InstructionError) as refused:
        understand(text, parametric_modules())
    assert reason in str(refused.value)

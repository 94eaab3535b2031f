from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import AmbiguousInstructionError, InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules


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

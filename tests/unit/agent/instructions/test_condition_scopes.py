from __future__ import annotations

import pytest

from aeros.agent.instructions.condition_scopes import scoped
from aeros.agent.instructions.grammar import parse_instruction
from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.refusals import InstructionError
from tests.unit.agent.instructions.lists.reference import reference_modules


def segments(text: str) -> list[str]:
    (sentence,) = parse_instruction(text)
    return [one.text for one in scoped(sentence, task_phrases(reference_modules()), [])]


def test_a_condition_ends_where_the_longest_declared_one_ends() -> None:
    assert segments("if the table is dirty clean it") == ["if the table is dirty", "clean it"]


def test_two_verbs_of_one_request_depend_on_one_condition() -> None:
    assert segments("if it is dirty, tidy the table and wipe it") == [
        "if it is dirty",
        "tidy the table wipe it",
    ]


@pytest.mark.parametrize(
    "text", ["if the table is dirty, clean it and make dumplings", "if it is dirty, clean it and sing"]
)
def test_two_requests_behind_a_condition_are_refused(text: str) -> None:
    with pytest.raises(InstructionError, match="which request depends"):
        segments(text)

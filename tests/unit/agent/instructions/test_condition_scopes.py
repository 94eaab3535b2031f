from __future__ import annotations

import pytest

from aeros.agent.instructions.condition_scopes import scoped
from aeros.agent.instructions.grammar import parse_instruction
from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules, reference_modules


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


@pytest.mark.parametrize(
    ("text", "has_condition"),
    [
        ("bring the can and clean the table if it is dirty", [False, True]),
        ("make dumplings, bring the can, and wipe the table if it is dirty", [False, False, True]),
    ],
)
def test_a_condition_on_it_is_of_the_request_that_it_must_mean(text: str, has_condition: list[bool]) -> None:
    meaning = understand(text, parametric_modules())
    assert [one.condition is not None for one in meaning.errands] == has_condition


@pytest.mark.parametrize(
    "text",
    [
        "clean the table and bring the can if it is dirty",
        "clear the table and wipe it if it is dirty",
        "bring the can and clean the table if necessary",
    ],
)
def test_a_condition_that_may_be_of_both_is_refused(text: str) -> None:
    with pytest.raises(InstructionError, match="which request depends"):
        understand(text, parametric_modules())

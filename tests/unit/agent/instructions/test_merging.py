from __future__ import annotations

import pytest

from aeros.agent.instructions.grammar import parse_instruction
from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.merging import merged_requests
from tests.unit.agent.instructions.lists.reference import parametric_modules


@pytest.mark.parametrize(
    ("text", "requests"),
    [
        ("wipe and tidy the table", ["wipe tidy the table"]),
        ("wrap and boil two dumplings", ["wrap and boil two dumplings"]),
        ("pick and place the block", ["pick and place the block"]),
        ("the left half of the table, wipe it", ["the left half of the table wipe it"]),
        ("wipe the table and make dumplings", ["wipe the table", "make dumplings"]),
        ("sing and dance", ["sing", "dance"]),
        ("wipe the left half and the table", ["wipe the left half", "the table"]),
        ("make a dumpling and two", ["make a dumpling", "two"]),
    ],
)
def test_the_fewest_segments_are_merged_with_which_all_is_understood(text: str, requests: list[str]) -> None:
    (sentence,) = parse_instruction(text)
    merged = merged_requests(sentence, task_phrases(parametric_modules()), [])
    assert [one.text for one in merged] == requests

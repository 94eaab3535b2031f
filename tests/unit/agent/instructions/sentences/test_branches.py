from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.sentences.branches import with_branches


@pytest.mark.parametrize(
    ("sentence", "branches"),
    [
        (
            "if it is dirty , clean it , otherwise , sing",
            [("if it is dirty , clean it", False), ("sing", True)],
        ),
        ("clean it if it is dirty or else sing", [("clean it if it is dirty", False), ("sing", True)]),
        ("if it is dirty , clean it , if not , sing", [("if it is dirty , clean it", False), ("sing", True)]),
        ("if not , sing", [("sing", True)]),
        ("otherwise sing", [("sing", True)]),
        ("if not clean , clean it", [("if not clean , clean it", False)]),
        ("if it is dirty , touch nothing else", [("if it is dirty , touch nothing else", False)]),
        ("clean it , otherwise sing", [("clean it , otherwise sing", False)]),
        ("clean it unless told otherwise", [("clean it unless told otherwise", False)]),
        (
            "if it is dirty , clean it because otherwise we sing",
            [("if it is dirty , clean it because otherwise we sing", False)],
        ),
    ],
)
def test_a_sentence_is_split_where_its_condition_has_another_branch(
    sentence: str, branches: list[tuple[str, bool]]
) -> None:
    found = with_branches([(tuple(sentence.split()), False)])
    assert [(" ".join(one.tokens), one.is_otherwise) for one in found] == branches


def test_the_question_mark_is_of_the_first_branch() -> None:
    sentence = ("could", "you", "clean", "it", "if", "it", "is", "dirty", ",", "otherwise", "sing")
    assert [one.is_question for one in with_branches([(sentence, True)])] == [True, False]


def test_more_than_two_branches_are_refused() -> None:
    with pytest.raises(InstructionError, match="a second `otherwise`"):
        list(with_branches([(("if", "dirty", "clean", "it", "else", "sing", "else", "dance"), False)]))

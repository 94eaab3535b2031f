from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.sentences.shares import without_shares


@pytest.mark.parametrize(
    ("words", "plain"),
    [
        ("make two teas , one for me and one for her", "make two teas"),
        ("two teas , that is , one for me , one for my bear , please", "two teas , please"),
        ("make a tea for me and one for my wife", "make two tea for me"),
        ("a tea for me and a tea for him , please", "two tea for me , please"),
        ("make me a tea and my brother one", "make me two tea"),
        ("a tea for me , one for her and another for him", "three tea for me"),
        ("make a tea for me and a cake for her", "make a tea for me and a cake for her"),
        ("make a tea for me and one for my sister next week", "make two tea for me next week"),
        ("make a tea for me and one for her can wait", "make two tea for me can wait"),
        ("make a tea for me and one for sunday", "make a tea for me and one for sunday"),
        ("make one for me", "make one for me"),
        ("make a tea each for me and my wife", "make two tea for me"),
        ("make a tea each for me and the kids", "make a tea each for me and the kids"),
        ("make a tea each for me and Ben and Mia", "make a tea each for me and Ben and Mia"),
        ("bring the can for me and the block for her", "bring the can for me and the block for her"),
    ],
)
def test_shares_of_several_are_one_number(words: str, plain: str) -> None:
    assert " ".join(without_shares(tuple(words.split()))) == plain


@pytest.mark.parametrize(
    "words", ["two teas , one for me , one for her and one for him", "make one for me and one for her"]
)
def test_shares_that_no_number_says_are_refused(words: str) -> None:
    with pytest.raises(InstructionError, match="shares"):
        without_shares(tuple(words.split()))

from __future__ import annotations

import pytest

from aeros.agent.instructions.sentences.rephrasing import rephrased, with_subject


@pytest.mark.parametrize(
    ("words", "plain"),
    [
        ("once the table is wiped , bring it", "once you have the table wiped , bring it"),
        ("bring it when the table cleaning is done", "bring it once you have the table cleaning"),
        ("when you are done with the cleaning , cook", "once you have the cleaning , cook"),
        ("when the table is wiped , cook", "when the table is wiped , cook"),
        ("once the table is not wiped , cook", "once the table is not wiped , cook"),
        ("once the guests are gone , cook", "once the guests are gone , cook"),
        ("cook , the table must not be cleaned", "cook , do not the table cleaned"),
        ("cook and leave the table alone", "cook and without the table"),
        ("leave the can where it is and cook", "without the can , cook"),
        ("keep the can there , and cook", "without the can , cook"),
        ("leave the can on the left", "leave the can on the left"),
        ("leave the left half and cook", "without the left half , cook"),
        ("cook , and when you are done with that , wipe", "cook , and when you are done with that , wipe"),
        ("clear it all up", "clear it up"),
        ("clean all of it", "clean it"),
        ("bring both the can and the block", "bring the can and the block"),
        ("clean both tables", "clean both tables"),
        ("the can and the tea should be brought", "the can should be brought and the tea should be brought"),
        ("bring both of them , the can and the block", "bring the can and the block"),
        ("find the can and bring it here", "bring the can here"),
        ("please look for the can , then put it down", "please put the can down"),
        ("find the can on the left and bring it", "find the can on the left and bring it"),
        ("find the can on the floor and bring it", "bring the can on the floor"),
        ("go to the floor , find the can and bring it", "bring the can from the floor"),
        ("go to the left , find the can and bring it", "go to the left , find the can and bring it"),
        ("find the can and clean the table", "find the can and clean the table"),
        ("need two teas", "i need two teas"),
        ("take the can and leave it on the left", "take the can and put it on the left"),
        ("the can is fine , leave it on the left", "the can is fine , leave it on the left"),
        ("look at the can and leave it on the left", "look at the can and leave it on the left"),
        ("leave the table for now and bring it", "without the table , bring it"),
        ("bring the can and put both on the left", "bring the can and put them on the left"),
        ("make teas , but just one", "make teas , one"),
        ("it is the can that i want", "i want the can"),
        ("it is", "it is"),
        ("bring first the can , then it", "bring the can , then it"),
        ("once you have finished the teas , wipe", "once you have done the teas , wipe"),
        ("when you have finished the teas , wipe", "when you have finished the teas , wipe"),
        ("you know the table , clean it", "you know the table , clean it"),
        ("we would rather have a tea than the can", "we want a tea rather than the can"),
        ("they would rather have a tea than the can", "they would rather have a tea than the can"),
        ("make teas until there are two", "make two teas"),
        ("make teas until you have got two of them , then it", "make two teas , then it"),
        ("make teas until you have two guests", "make teas until you have two guests"),
        ("make two teas until you have one", "make two teas until you have one"),
        ("wipe it until you have two", "wipe it until you have two"),
    ],
)
def test_a_sentence_is_written_in_the_words_of_the_grammar(words: str, plain: str) -> None:
    assert " ".join(rephrased(tuple(words.split()))) == plain


@pytest.mark.parametrize(
    ("words", "whole"),
    [
        ("clean the table , is very dirty", "clean the table , it is very dirty"),
        ("the table , is it dirty", "the table , is it dirty"),
        ("the table , is the can there", "the table , is the can there"),
        ("clean it , is not dirty", "clean it , is not dirty"),
    ],
)
def test_a_subject_that_was_left_out_is_what_was_named(words: str, whole: str) -> None:
    assert " ".join(with_subject(tuple(words.split()))) == whole

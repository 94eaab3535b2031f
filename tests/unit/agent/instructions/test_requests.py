from __future__ import annotations

import pytest

from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.requests import Request, read_request
from aeros.agent.instructions.segments import Link, Mood, Segment
from tests.unit.agent.instructions.lists.reference import parametric_modules


def read(words: str, condition: str = "", marker: str = "if") -> Request:
    segment = Segment(Mood.REQUEST, tuple(words.split()), Link.START)
    depends = Segment(Mood.CONDITION, tuple(condition.split()), Link.START, (marker,)) if condition else None
    return read_request(segment, depends, task_phrases(parametric_modules()), [])


def test_a_request_says_which_arguments_its_words_state() -> None:
    request = read("wipe the left half of the table")
    assert request.stated == {"region"}
    assert request.errand.routed.arguments == {"region": "left"}
    assert not request.only_refers
    assert not read("wipe the table").stated


@pytest.mark.parametrize(
    ("marker", "condition", "text"),
    [
        ("if", "the table is dirty", "not table_wiped"),
        ("unless", "the table is dirty", "not (not table_wiped)"),
        ("if", "the table is not dirty", "not (not table_wiped)"),
        ("unless", "the table is not dirty", "not table_wiped"),
    ],
)
def test_unless_and_not_negate_a_condition_and_each_other(marker: str, condition: str, text: str) -> None:
    assert read("make dumplings", condition, marker).errand.condition_text == text


@pytest.mark.parametrize("words", ["clean the table or", "clean never the table", "clean the moon"])
def test_a_choice_a_negation_and_an_unknown_word_are_refused(words: str) -> None:
    with pytest.raises(InstructionError):
        read(words)


def read_after(words: str, link: Link, joint: str) -> Request:
    segment = Segment(Mood.REQUEST, tuple(words.split()), link, joint=joint)
    return read_request(segment, None, task_phrases(parametric_modules()), [])


@pytest.mark.parametrize(
    ("words", "link", "joint"),
    [
        ("two dumplings", Link.THEN, "then"),
        ("2 dumplings", Link.THEN, "followed by"),
        ("a dumpling", Link.JOINED, "followed by"),
    ],
)
def test_a_number_of_things_may_follow_as_a_wish(words: str, link: Link, joint: str) -> None:
    assert read_after(words, link, joint).errand.routed.task.id == "make_dumplings"


@pytest.mark.parametrize(
    ("words", "link"), [("a can", Link.THEN), ("the table", Link.THEN), ("2 dumplings", Link.JOINED)]
)
def test_a_thing_without_a_verb_may_be_about_the_verb_before(words: str, link: Link) -> None:
    with pytest.raises(InstructionError, match="does not say what `"):
        read_after(words, link, "and")

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.agent.instructions.conditions import FoundCondition, find_condition
from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.segments import Link, Mood, Segment
from aeros.spec.model.ecm import ActionCondition
from tests.unit.agent.dumplings import SPAN, module, task, term

COLD = ActionCondition(term("not wrapper_aligned"), "not wrapper_aligned", SPAN)
TEA = replace(
    task("tea", ("make",), "wrapper_aligned"),
    object_phrases=("tea",),
    condition_phrases={"the tea is cold": COLD, "the tea is not hot": COLD, "needed": COLD},
)


def finds(words: str, *, is_own: bool = False) -> bool:
    (entry,) = task_phrases({"kitchen": module("kitchen", (), TEA)})
    found = find_condition(Segment(Mood.CONDITION, tuple(words.split()), Link.START), entry, is_own=is_own)
    return found == FoundCondition(COLD.term, COLD.text)


@pytest.mark.parametrize(
    "words",
    [
        "the tea is cold",
        "the tea looks cold",
        "the tea has been cold",
        "tea s cold",
        "that tea is still cold",
        "the tea isn t hot",
        "tea cold",
        "the tea actually cold",
    ],
)
def test_declared_words_are_found_in_each_spelling(words: str) -> None:
    assert finds(words)


@pytest.mark.parametrize(
    "words", ["it is cold", "they is cold", "it s cold", "cold", "needed", "it is needed"]
)
def test_a_pronoun_or_no_word_stands_for_the_object_of_the_own_task_alone(words: str) -> None:
    assert finds(words, is_own=True)
    assert not finds(words)


@pytest.mark.parametrize(
    "words",
    [
        "the tea is hot",
        "the tea is very cold",
        "the coffee is cold",
        "the tea is not cold",
        "not the tea is cold",
        "is cold",
        "",
    ],
)
def test_other_words_are_not(words: str) -> None:
    assert not finds(words, is_own=True)


@pytest.mark.parametrize("words", ["the tea is not cold", "the tea isn t cold"])
def test_a_negated_condition_is_negated(words: str) -> None:
    (entry,) = task_phrases({"kitchen": module("kitchen", (), TEA)})
    found = find_condition(Segment(Mood.CONDITION, tuple(words.split()), Link.START), entry)
    assert found is not None
    assert (found.text, found.negated.text) == ("not (not wrapper_aligned)", "not wrapper_aligned")
    assert found.negated.term == COLD.term


def test_a_statement_without_a_verb_is_no_condition() -> None:
    (entry,) = task_phrases({"kitchen": module("kitchen", (), TEA)})
    assert find_condition(Segment(Mood.REQUEST, ("tea", "cold"), Link.START), entry) is None

from __future__ import annotations

import pytest

from aeros.agent.instructions.sentences.clauses import (
    carried_words,
    segments_of,
    strip_closers,
    strip_ends,
    strip_openers,
)


def test_courtesies_are_stripped_from_both_ends() -> None:
    assert strip_openers(("could", "you", "please", "cook")) == ("cook",)
    assert strip_closers(("cook", "for", "me", "please")) == ("cook",)
    assert strip_ends(("cook", ",", "please", ",", "thanks")) == ("cook",)


@pytest.mark.parametrize(
    ("words", "carried"),
    [
        ("have the table cleaned and a dumpling made", [("have",)]),
        ("the table should be wiped and a dumpling cooked", [("have",)]),
        ("i want the table cleaned and two dumplings", [("have",), ("i", "want")]),
        ("clean the table and two dumplings", []),
    ],
)
def test_later_requests_go_on_with_a_causative_or_a_wish(words: str, carried: list[tuple[str, ...]]) -> None:
    assert carried_words(list(segments_of(tuple(words.split())))) == tuple(carried)


def test_an_act_that_is_named_last_is_no_condition_on_time() -> None:
    (segment,) = segments_of(("do", "the", "left", "half", "when", "cleaning"))
    assert segment.words == ("left", "half", "when", "cleaning")
    assert segment.is_light

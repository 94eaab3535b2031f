from __future__ import annotations

import pytest

from aeros.agent.instructions.coverage import Coverage
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import task_phrases
from tests.unit.agent.instructions.lists.reference import parametric_modules


def coverage_of(words: str, task: str) -> Coverage:
    entry = next(one for one in task_phrases(parametric_modules()) if one.routed.task.id == task)
    return cover(entry, tuple(words.split()), knows_pronoun=False)


@pytest.mark.parametrize(
    ("words", "is_whole"),
    [
        ("red can to the left", True),
        ("red can left", True),
        ("the red can left", False),
        ("red can on the left", False),
        ("red can", False),
        ("to the left", False),
        ("bring red can to the left", False),
    ],
)
def test_a_thing_and_where_it_is_to_go_need_no_verb(words: str, is_whole: bool) -> None:
    assert coverage_of(words, "fetch_object").is_whole_without_verb(is_light=False) is is_whole


@pytest.mark.parametrize(("words", "is_whole"), [("the left half of the table", True), ("the table", False)])
def test_after_do_a_part_needs_no_other_verb(words: str, is_whole: bool) -> None:
    assert coverage_of(words, "clean_table").is_whole_without_verb(is_light=True) is is_whole
    assert not coverage_of(words, "clean_table").is_whole_without_verb(is_light=False)


@pytest.mark.parametrize(
    ("words", "is_whole"),
    [
        ("put the can on the left", True),
        ("bring the can to the left", True),
        ("bring the can on the left", False),
        ("bring the left can", False),
        ("bring the can on the left of the delivery stand", True),
    ],
)
def test_a_place_that_may_say_which_thing_is_not_where_it_goes(words: str, is_whole: bool) -> None:
    assert coverage_of(words, "fetch_object").is_whole is is_whole

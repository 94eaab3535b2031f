from __future__ import annotations

from typing import Any

import pytest
import yaml

from aeros.agent.instructions.refusals import AmbiguousInstructionError, InstructionError, NothingAskedError
from aeros.agent.instructions.understand import understand
from aeros.agent.reading.nearest import NearestReading, nearest_reading
from tests.unit.agent.instructions.lists.reference import LISTS, parametric_modules
from tests.unit.agent.instructions.lists.test_lists import REFUSE, is_right


def nearest(instruction: str) -> NearestReading | None:
    return nearest_reading(instruction, parametric_modules())


@pytest.mark.parametrize(
    ("instruction", "left_out", "meaning"),
    [
        ("Clean the table, she'll only throw it.", ", she'll only throw it", "clean_table.clean_table"),
        (
            "Just clean the right side of the table, I've already done the left.",
            ", I've already done the left",
            "clean_table.clean_table(region = right)",
        ),
        ("Zorble, clean the flummoxed table", "Zorble … flummoxed", "clean_table.clean_table"),
    ],
)
def test_the_words_left_out_are_shown_as_the_user_wrote_them(
    instruction: str, left_out: str, meaning: str
) -> None:
    found = nearest(instruction)
    assert found is not None
    assert found.left_out == left_out
    assert found.meaning.formal_lines[0].startswith(meaning)
    # A run that is resumed reads these words again.
    again = understand(found.meaning.instruction, parametric_modules())
    assert again.formal_lines == found.meaning.formal_lines


@pytest.mark.parametrize(
    "instruction",
    [
        "If the kettle whistles, fetch the can.",
        "Fetch the blue can.",
        "Make three dumplings.",
        "Put the table on the can.",
        "Never ever zorble the table.",
        "Did you already clean the table?",
        "Bring the red can or the blue block.",
        "Wipe the table twice.",
        "Put the can off.",
        "play some jazz",
        "",
        "Clean the table while nobody is near.",
        "Clean the table where there is no glass.",
        "Clean the table, while the kettle boils.",
        "Clean the table, they said do not.",
        "Clean the table, people must leave first.",
        "Clean the table, we will tell you when.",
        "Clean the table, I meant the can.",
        "Clean the table, I have said it twice.",
        "Clean the table after the guests leave.",
        "Clean the table tomorrow.",
        "Clean the table if you find the floor dirty.",
        "Fetch the purple can.",
        "Bring her the green block.",
        "Clean the 2nd table.",
        "Make hundreds of dumplings.",
        "Make dumplings for each guest.",
        "Put the can anywhere but left.",
        "Prevent cleaning the table.",
        "Abstain from cleaning the table.",
        "Pretend to clean the table.",
        "Tell Bob to clean the table.",
        "Imagine you clean the table.",
        "He said: clean the table.",
        "Clean the table, we have the left side in use.",
        "Clean the table psych",
        "Clean the table x2",
        "Clean beneath the table.",
        "Fetch the dark red can.",
        "Make -1 dumplings.",
    ],
)
def test_words_that_may_turn_the_meaning_round_are_not_left_out(instruction: str) -> None:
    assert nearest(instruction) is None


def test_a_long_instruction_is_refused_at_once() -> None:
    assert nearest("clean the table" + " zorble" * 100) is not None
    assert nearest("clean the table" + " zorble" * 2000) is None


def test_an_instruction_with_too_many_phrases_to_try_has_no_nearest_words(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    instruction = "Clean the table with great big care"
    found = nearest(instruction)
    assert found is not None
    monkeypatch.setattr("aeros.agent.reading.nearest._MOST_TRIES", 1)
    assert nearest(instruction) is None


def test_two_meanings_that_are_as_near_are_none() -> None:
    assert nearest("zorble the table clean the table bring the can") is None


def test_a_third_of_the_wrongly_refused_sentences_is_read_rightly_without_a_phrase() -> None:
    cases: list[dict[str, Any]] = yaml.safe_load((LISTS / "unseen_13.yaml").read_text(encoding="utf-8"))
    right, others, wrong = 0, 0, []
    for case in (one for one in cases if one["want"] != REFUSE):
        try:
            understand(case["say"], parametric_modules())
            continue
        except (AmbiguousInstructionError, NothingAskedError):
            continue
        except InstructionError:
            found = nearest(case["say"])
        if found is None:
            others += 1
        elif is_right(found.meaning, case):
            right += 1
        else:
            wrong.append(case["say"])
    assert wrong == []
    assert right >= 0.35 * (right + others)
    assert right >= 12

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
        ("zorble clean the flummoxed table", "zorble … flummoxed", "clean_table.clean_table"),
    ],
)
def test_a_phrase_that_is_left_out_is_shown_in_the_words_of_the_user(
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
    ],
)
def test_a_phrase_that_may_turn_the_meaning_round_is_not_left_out(instruction: str) -> None:
    assert nearest(instruction) is None


def test_two_meanings_that_are_as_near_are_none() -> None:
    assert nearest("zorble the table clean the table bring the can") is None


def test_half_of_what_is_wrongly_refused_is_read_rightly_without_a_phrase() -> None:
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
    assert right >= 0.45 * (right + others)
    assert right >= 15

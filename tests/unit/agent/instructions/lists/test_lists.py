"""Lists of instructions, most by people who had not seen the grammar: none moves the robot wrongly."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
import yaml

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import LISTS, parametric_modules

REFUSE = "refuse"
CONDITIONS = {
    ("if", "table dirty"): ("not table_wiped", "not (table_wiped)"),
    ("unless", "table dirty"): ("table_wiped", "not (not table_wiped)"),
    ("unless", "table clean"): ("not table_wiped", "not (table_wiped)"),
    ("if", "table clean"): ("table_wiped", "not (not table_wiped)"),
    ("if", "table untidy"): ("clutter_on_table", "not (table_organized)"),
    ("if", "table tidy"): ("table_organized", "not (clutter_on_table)"),
    ("unless", "table tidy"): ("not (table_organized)", "clutter_on_table"),
    ("unless", "table untidy"): ("not (clutter_on_table)", "table_organized"),
}
KEYS_BESIDE_ARGUMENTS = {"task", "if", "unless", "otherwise"}
FLOORS = {
    "unseen_1": 0.99,
    "unseen_2": 0.99,
    "unseen_3": 0.98,
    "unseen_4": 0.9,
    "unseen_5": 0.59,
    "unseen_6": 0.87,
    "unseen_7": 0.4,
    "unseen_8": 0.8,
    "unseen_9": 0.9,
    "unseen_10": 0.72,
    "unseen_11": 0.85,
    "unseen_12": 0.5,
    "unseen_13": 0.45,
    "unseen_14": 0.86,
    "unseen_15": 0.82,
    "unseen_16": 0.88,
    "unseen_17": 0.7,
    "unseen_18": 0.74,
    "unseen_19": 0.7,
    "unseen_20": 0.6,
    "unseen_21": 0.7,
    "unseen_22": 0.84,
    "unseen_23": 0.8,
    "unseen_24": 0.87,
    "unseen_25": 0.84,
    "unseen_26": 0.89,
    "unseen_27": 0.9,
    "unseen_28": 0.78,
    "authors_2": 0.95,
    "authors_3": 0.96,
    "authors_4": 0.97,
    "adversarial": 0.95,
    "adversarial_2": 0.8,
}
"""Shares of those that can be done that the grammar understands."""

EACH_PUSH = ("unseen_12", "unseen_20", "adversarial")
"""Lists that each push tries; the others are `deep`."""


def is_right(meaning: Understanding, case: dict[str, Any]) -> bool:
    if sorted(routed.task.id for routed in meaning.prohibited) != sorted(case.get("never", [])):
        return False
    if len(meaning.errands) != len(case["want"]):
        return False
    for errand, wanted in zip(meaning.errands, case["want"], strict=True):
        condition = next((key for key in wanted.items() if key in CONDITIONS), None)
        texts = ("",) if condition is None else CONDITIONS[condition]
        if errand.is_otherwise != wanted.get("otherwise", False):
            return False
        if errand.routed.task.id != wanted["task"] or errand.condition_text not in texts:
            return False
        expected = {key: str(value) for key, value in wanted.items() if key not in KEYS_BESIDE_ARGUMENTS}
        given = {name: str(value) for name, value in errand.routed.arguments.items()}
        defaults = {name: str(one.default) for name, one in errand.routed.task.parameters.items()}
        if given != {**defaults, **expected}:
            return False
    return True


def outcome(case: dict[str, Any]) -> str:
    try:
        meaning = understand(case["say"], parametric_modules())
    except InstructionError:
        return "refused"
    if case["want"] == REFUSE or not is_right(meaning, case):
        return "wrong motion"
    return "right"


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=() if one in EACH_PUSH else pytest.mark.deep) for one in FLOORS]
)
def test_none_moves_the_robot_wrongly_and_most_that_can_be_done_are_understood(name: str) -> None:
    cases: list[dict[str, Any]] = yaml.safe_load((LISTS / f"{name}.yaml").read_text(encoding="utf-8"))
    outcomes = {case["say"]: outcome(case) for case in cases}
    assert [text for text, found in outcomes.items() if found == "wrong motion"] == []
    doable = [case["say"] for case in cases if case["want"] != REFUSE]
    counted = Counter(outcomes[text] for text in doable)
    assert counted["right"] >= FLOORS[name] * len(doable), [
        text for text in doable if outcomes[text] != "right"
    ]
    assert len(outcomes) >= 60

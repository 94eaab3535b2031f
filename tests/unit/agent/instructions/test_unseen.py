"""Instructions of somebody who had not seen the grammar: none moves wrongly, and most are understood."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import yaml

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.reference import reference_modules

UNSEEN: list[dict[str, Any]] = yaml.safe_load(
    (Path(__file__).parent / "unseen.yaml").read_text(encoding="utf-8")
)
REFUSE = "refuse"
CONDITIONS = {
    ("if", "table dirty"): ("not table_wiped", "not (table_wiped)"),
    ("unless", "table dirty"): ("table_wiped", "not (not table_wiped)"),
    ("if", "table untidy"): ("clutter_on_table",),
}
KEYS_BESIDE_ARGUMENTS = {"task", "if", "unless"}


def is_right(meaning: Understanding, case: dict[str, Any]) -> bool:
    if [routed.task.id for routed in meaning.prohibited] != case.get("never", []):
        return False
    if len(meaning.errands) != len(case["want"]):
        return False
    for errand, wanted in zip(meaning.errands, case["want"], strict=True):
        condition = next((key for key in wanted.items() if key in CONDITIONS), None)
        texts = ("",) if condition is None else CONDITIONS[condition]
        if errand.routed.task.id != wanted["task"] or errand.condition_text not in texts:
            return False
        expected = {key: str(value) for key, value in wanted.items() if key not in KEYS_BESIDE_ARGUMENTS}
        given = {name: str(value) for name, value in errand.routed.arguments.items()}
        defaults = {name: str(one.default) for name, one in errand.routed.task.parameters.items()}
        if given != {**defaults, **expected}:
            return False
    return True


def has_its_parameters(case: dict[str, Any]) -> bool:
    """True if the tasks have the parameters that the requests set."""
    tasks = {task.id: task for module in reference_modules().values() for task in module.tasks.values()}
    return all(
        (wanted.keys() - KEYS_BESIDE_ARGUMENTS) <= tasks[wanted["task"]].parameters.keys()
        for wanted in (case["want"] if case["want"] != REFUSE else [])
    )


def outcome(case: dict[str, Any]) -> str:
    try:
        meaning = understand(case["say"], reference_modules())
    except InstructionError:
        return "refused"
    if case["want"] == REFUSE or not is_right(meaning, case):
        return "wrong motion"
    return "right"


def test_none_moves_the_robot_wrongly_and_most_that_can_be_done_are_understood() -> None:
    outcomes = {case["say"]: outcome(case) for case in UNSEEN}
    assert [text for text, found in outcomes.items() if found == "wrong motion"] == []
    doable = [case["say"] for case in UNSEEN if case["want"] != REFUSE and has_its_parameters(case)]
    counted = Counter(outcomes[text] for text in doable)
    assert counted["right"] >= 0.9 * len(doable), [text for text in doable if outcomes[text] != "right"]
    assert len(doable) >= 50

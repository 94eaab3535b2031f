"""Notes about branches that nothing decided, and the referee's judgement after a run."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.apps.why.judged_end import refuted_belief, undecided_branches

UNDECIDED = {"number": 1, "reason": "unknown", "causes": [{"kind": "definition"}]}


def test_undecided_branches_of_the_task_are_listed_from_the_last_one() -> None:
    notes = [
        (0, "replan", UNDECIDED),
        (1, "task-selected", {}),
        (2, "replan", UNDECIDED),
        (3, "replan", {"number": 2, "reason": "a step failed"}),
        (4, "replan", {**UNDECIDED, "number": 3}),
        (5, "run-ended", {}),
        (6, "replan", UNDECIDED),
    ]
    found = [(at, text) for at, text, _ in undecided_branches(notes, 5)]
    assert found == [(4, "re-plan 3: unknown"), (2, "re-plan 1: unknown")]


@pytest.mark.parametrize(
    ("details", "found"),
    [
        ({"believed": True, "true": False, "values": {"a": False}}, (1, "in the simulator a = false")),
        ({"believed": True, "true": False}, (1, "in the simulator the goal is false")),
        ({"believed": True, "true": None, "values": {}}, None),
        ({"believed": True, "true": True, "values": {"a": True}}, None),
        ({"believed": False, "true": False, "values": {"a": False}}, None),
    ],
)
def test_only_the_truth_refutes_a_belief(details: dict[str, Any], found: tuple[int, str] | None) -> None:
    records: list[Any] = [{"event": "note", "details": {}}, {"event": "goal-judged", "details": details}]
    assert refuted_belief(records, 0) == found

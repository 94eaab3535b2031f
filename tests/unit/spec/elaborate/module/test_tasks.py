"""Tasks of a module: goals, task invariants and planning rules."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_module

_TASK = """
tasks:
  tidy_up:
    description: tidy the table
    words: [tidy]
    goal: table_tidy
    rules:
      - {unless: table_tidy, do: tidy, retry: 1}

permissions:"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("", "", None),
        ("words: [tidy]", "words: []", "no word routes to the task `tidy_up`"),
        ("do: tidy", "do: tidi", "`tidi` is not a skill or capability of this module"),
        ("retry: 1", "retry: 3", "this site allows at most 2 retries of a step"),
        ("retry: 1", "between_tries: tidy", "`between_tries` runs between two tries, so it needs `retry`"),
        ("retry: 1", "inputs: {force: 1 N}", "`force` is not an input of `tidy`"),
        ("goal: table_tidy\n", "goal: table_tidy\n    report: [table_tidy]\n", None),
        ("goal: table_tidy\n", "goal: table_tidy\n    report: [table_tidi]\n", "`table_tidi`"),
        (
            "goal: table_tidy\n",
            "goal: table_tidy\n    invariants:\n" + "      - {id: clean, require: table_tidy}\n" * 2,
            "the invariant `clean` is declared twice",
        ),
    ],
)
def test_a_fault_of_a_task_is_reported(tmp_path: Path, old: str, new: str, message: str | None) -> None:
    found = messages_of_module(tmp_path, ("\npermissions:", _TASK.replace(old, new, 1)))
    assert found == [] if message is None else any(message in line for line in found), found

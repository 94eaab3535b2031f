"""Decisions as rows of a table: those that follow each other and say the same are one row.

So a row stands for all plain ALLOWs of a skill for one kind of action in a stretch, or for a denial that
was asked for again and again; each other decision has a row to itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from aeros.apps.report_page.run_data import RecordedDecision

MAX_ROWS: Final = 2_000
"""Rows of one table; of a longer one the denials and reductions are kept first."""


@dataclass
class DecisionRow:
    """Decisions `first` to `last`, `count` of them, by one skill for one kind and for the same reasons."""

    first: RecordedDecision
    last: RecordedDecision
    count: int = 1

    @property
    def is_plain_allow(self) -> bool:
        """Whether there is nothing to explain."""
        return self.first.decision == "ALLOW" and not self.first.reasons


def group_decisions(decisions: Sequence[RecordedDecision]) -> tuple[list[DecisionRow], int]:
    """The rows, in order, and how many decisions are in rows that were left out."""
    rows: list[DecisionRow] = []
    latest: dict[str, DecisionRow] = {}
    for one in decisions:
        row = latest.get(one.skill)
        if row is not None and _is_same_decision(row.last, one):
            row.last, row.count = one, row.count + 1
            continue
        latest[one.skill] = DecisionRow(one, one)
        rows.append(latest[one.skill])
    if len(rows) <= MAX_ROWS:
        return rows, 0
    kept = sorted(rows, key=lambda row: row.is_plain_allow)[:MAX_ROWS]
    kept.sort(key=lambda row: row.first.sequence)
    return kept, len(decisions) - sum(row.count for row in kept)


def _is_same_decision(one: RecordedDecision, other: RecordedDecision) -> bool:
    mine = (one.decision, one.kind, [reason[:2] for reason in one.reasons])
    return mine == (other.decision, other.kind, [reason[:2] for reason in other.reasons])

"""Group decisions into table rows: consecutive equal decisions of a skill share one row.

One row holds consecutive plain ALLOWs of a skill for one kind of action, or consecutive equal denials; every
other decision has its own row.
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
    """Consecutive decisions with the same skill, action kind and reasons.

    Attributes:
        first: The first of them.
        last: The last of them.
        count: How many they are.
    """

    first: RecordedDecision
    last: RecordedDecision
    count: int = 1

    @property
    def is_plain_allow(self) -> bool:
        """True if the decision is ALLOW without reasons."""
        return self.first.decision == "ALLOW" and not self.first.reasons


def group_decisions(decisions: Sequence[RecordedDecision]) -> tuple[list[DecisionRow], int]:
    """Group decisions into rows.

    Args:
        decisions: Decisions in order.

    Returns:
        At most `MAX_ROWS` rows in order, and the number of decisions in rows that were left out.
    """
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

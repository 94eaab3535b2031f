"""Decisions that say the same share a row; of too many rows the plain ones go first."""

from __future__ import annotations

from aeros.apps.report_page.rows import MAX_ROWS, group_decisions
from aeros.apps.report_page.run_data import RecordedDecision


def decided(
    number: int, verdict: str = "ALLOW", skill: str = "a", kind: str = "move", rule: str = ""
) -> RecordedDecision:
    reasons = (("AE750", rule, f"said {number}"),) if rule else ()
    return RecordedDecision(number, float(number), verdict, skill, kind, {}, {}, reasons, None, {})


def shown(*decisions: RecordedDecision) -> list[tuple[int, int, int]]:
    return [(row.first.sequence, row.last.sequence, row.count) for row in group_decisions(decisions)[0]]


def test_a_stretch_of_the_same_is_one_row() -> None:
    assert shown(*(decided(number) for number in range(5))) == [(0, 4, 5)]


def test_another_kind_verdict_or_rule_begins_a_row() -> None:
    assert shown(
        decided(0), decided(1, kind="grip"), decided(2, "DENY", "a", "grip", "r"),
        decided(3, "DENY", "a", "grip", "r"), decided(4, "DENY", "a", "grip", "s"),
    ) == [(0, 0, 1), (1, 1, 1), (2, 3, 2), (4, 4, 1)]  # fmt: skip


def test_skills_at_the_same_time_do_not_break_each_others_rows() -> None:
    assert shown(decided(0), decided(1, skill="b"), decided(2), decided(3, skill="b")) == [
        (0, 2, 2),
        (1, 3, 2),
    ]


def test_of_too_many_rows_every_denial_is_kept() -> None:
    kinds = [decided(2 * n, kind=f"k{n}") for n in range(MAX_ROWS)]
    denials = [decided(2 * n + 1, "DENY", "b", f"k{n}", "r") for n in range(100)]
    rows, left_out = group_decisions(sorted(kinds + denials, key=lambda one: one.sequence))
    assert len(rows) == MAX_ROWS
    assert left_out == 100
    assert sum(row.first.decision == "DENY" for row in rows) == 100
    assert [row.first.sequence for row in rows] == sorted(row.first.sequence for row in rows)

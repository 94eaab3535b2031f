"""Diagnostics of one cause become one, at the place of the first."""

from __future__ import annotations

from dataclasses import replace

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.repeated import merge_repeated


def test_diagnostics_of_one_cause_become_one_where_the_first_was() -> None:
    found = [Diagnostic("AE202", headline, None) for headline in ("x 1", "other", "x 2", "y 1", "x 3")]
    causes = {"x": "x", "y": "y"}
    merged = merge_repeated(
        found,
        lambda one: causes.get(one.headline[0]),
        lambda cause, group: replace(group[0], headline=f"{cause}: {len(group)} times"),
    )
    assert [one.headline for one in merged] == ["x: 3 times", "other", "y 1"]

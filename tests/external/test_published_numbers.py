"""docs/benchmarks-external.md has the numbers of the results that are kept."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from benchmarks.external.safe_agent_bench.demands import counts, read_demands

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "benchmarks-external.md").read_text("utf-8")
TEXT = " ".join(PAGE.split())


def _result(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DOCS / "results" / "external" / name).read_text("utf-8"))
    assert not found["environment"]["commit"].endswith("+"), "measured with uncommitted changes"
    return found


IS_BENCH, ARMGUARD = _result("is-bench.json"), _result("armguard.json")


@pytest.mark.parametrize("kind", ["dropped", "swapped", "postponed"])
def test_the_table_of_mutants_is_that_of_the_result(kind: str) -> None:
    found = IS_BENCH["findings"]["mutants"][kind]
    refused = found["safe_refused"]
    row = [
        kind,
        found["mutants"],
        found["unsafe"],
        found["unsafe_accepted"],
        found["unsafe_accepted_by_control"],
    ]
    row += [found["safe_accepted"], refused["a step cannot be run"], refused["the goal is not reached"]]
    assert "| " + " | ".join(map(str, row)) + " |" in PAGE
    assert refused.keys() == {"a step cannot be run", "the goal is not reached"}
    assert found["unsafe_only"] == found["unsafe_accepted_by_control"]


def test_the_sums_and_the_plans_are_those_of_the_result() -> None:
    mutants = IS_BENCH["findings"]["mutants"].values()
    assert f"{sum(one['mutants'] for one in mutants):,} mutants" in TEXT
    assert f"{sum(one['unsafe'] for one in mutants):,} unsafe mutants, 0 accepted" in TEXT
    assert sum(one["unsafe_accepted"] for one in mutants) == 0
    assert IS_BENCH["findings"]["unexplained"] == []
    assert IS_BENCH["findings"]["left_out"] == {}
    outcomes = Counter(one["outcome"] for one in IS_BENCH["own_plans"])
    assert outcomes == {"safe": 160, "none": 1}
    assert "For 160 of 161 tasks it finds a plan" in TEXT
    assert IS_BENCH["benchmark"]["commit"].startswith("812f545")
    idle = sum(IS_BENCH["findings"]["idle_conditions"].values())
    assert f"{idle} of the 321 conditions" in TEXT


def test_each_refused_example_plan_is_named_and_both_verdicts_agree() -> None:
    examples = IS_BENCH["findings"]["examples"]
    refused = [one for one in examples if not one["accepted"]]
    assert f"AEROS accepts {len(examples) - len(refused)} of the {len(examples)} example plans" in TEXT
    for one in examples:
        is_good = one["is_safe"] and one["reached"] and not one["failed"]
        assert one["accepted"] is is_good
    for one in refused:
        assert f"`{one['task']}`" in PAGE


def test_the_numbers_beside_the_keep_out_box_are_those_of_the_result() -> None:
    found = ARMGUARD["counts"]
    rows = [
        f"| all | {found['motions']} | {found['inside']} | {found['nearer_than_clearance']} |",
        f"| accepted by armguard-mcp | {found['armguard_accepts']} | {found['armguard_accepts_inside']} | |",
        f"| allowed by AEROS | {found['aeros_allows']} | {found['aeros_allows_inside']} "
        f"| {found['aeros_allows_nearer_than_clearance']} |",
    ]
    assert [row for row in rows if row not in PAGE] == []
    assert (
        f"AEROS refuses {found['aeros_refuses']}. Of these, {found['aeros_refuses_needlessly']} keep" in TEXT
    )
    assert f"finds {found['hulls_clear']} motions clear" in TEXT
    assert found["hulls_clear_nearer_than_clearance"] == 0


def test_the_table_of_demands_is_that_of_the_file() -> None:
    found = counts(read_demands())
    for start, kind in (("| order:", "order"), ("| deadline:", "deadline"), ("| no bound:", "eventual")):
        row = next(line for line in PAGE.splitlines() if line.startswith(start))
        assert f"| {found[kind]} |" in row

"""A whole report of made-up trials, compared with files: its data, and its text.

The numbers of trials are a table by seed, so shares, means and tests can be counted by hand in `results.txt`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="needs `pip install '.[experiments]'`")

from aeros.experiments.catalogue import EnteredArchitecture, Row, catalogue, select_rows
from aeros.experiments.report.document import document
from aeros.experiments.report.results import compute_results
from aeros.experiments.trial_kinds import condition_digest
from tests.reports_in_full import compare_with_file
from tests.unit.experiments.support.common import premises

HERE = Path(__file__).parent
NAMES = (
    "2/retry",
    *(
        f"4/{name}/{task}"
        for name in ("flat", "behaviour_tree", "aeros")
        for task in ("make_dumplings", "clean_table")
    ),
    "4/Stubborn/clean_table",
)
ENTRY = EnteredArchitecture("tests.unit.experiments.support.entered:Stubborn")
SEEDS = range(5, 15)
FAILING = {"flat": {6, 8, 9, 13}, "behaviour_tree": {8, 13, 14}, "Stubborn": {*SEEDS}}
"""Seeds of trials that do not reach their goal, by variant."""


def _made(row: Row, seed: int) -> dict[str, Any]:
    """Findings of a trial."""
    reached = seed not in FAILING.get(row.variant, {9})
    found: dict[str, Any] = {"reached": reached, "processor_s": 0.25, "alone_s": 0.001 * seed}
    found |= {"tries": 2, "failed_tries": 0 if reached else 2, "false_claim": seed == 7, "steps": seed % 4}
    found |= {"replans": 3.0, "recoveries": int(seed == 5), "live": seed < 8}
    if row.variant == "Stubborn":
        found |= {"raised": "KeyError: 'x'" if seed == 12 else "", "told": ["gave up"] if seed > 12 else []}
    if row.variant == "retry":
        found |= {"reaction_s": 0.5}
    if row.condition.kind == "sessions":
        found |= {"series": {"success": [1.0 * reached, seed / 10], "tries": [2.0, 3.0]}, "late": 0.75}
    return found


@cache
def _results() -> dict[str, Any]:
    experiments = select_rows(catalogue("symbolic", [ENTRY]), NAMES)
    trials = {
        (condition_digest(row.condition, premises().digest), seed): _made(row, seed)
        for one in experiments
        for row in one.rows
        for seed in SEEDS
    }
    results = compute_results(experiments, trials, premises(), SEEDS, "symbolic", "--plant symbolic")
    results["environment"] = {"commit": None, "python": "3", "platform": "x", "processors": 2, "packages": {}}
    results |= {"premises": "of the modules", "sources": "of the code"}
    for row in (row for one in results["experiments"] for row in one["rows"]):
        row["digest"] = f"of {row['id']}"
    return results


def _lines(value: Any, place: str = "") -> Iterator[str]:
    """Write each value with its place, numbers with nine digits."""
    if isinstance(value, dict):
        for name, one in value.items():
            yield from _lines(one, f"{place}.{name}" if place else str(name))
    elif isinstance(value, list | tuple) and any(isinstance(one, dict) for one in value):
        for number, one in enumerate(value):
            yield from _lines(one, f"{place}[{number}]")
    else:
        rounded = json.loads(json.dumps(value), parse_float=lambda text: float(f"{float(text):.9g}"))
        yield f"{place}: {json.dumps(rounded, ensure_ascii=False)}"


def test_the_data_of_a_report() -> None:
    compare_with_file(HERE / "results.txt", "\n".join(_lines(_results())) + "\n")


def test_the_text_of_a_report() -> None:
    blocks = [block.markdown for block in document(_results(), "figures")]
    compare_with_file(HERE / "report.txt", "\n\n".join(blocks) + "\n")

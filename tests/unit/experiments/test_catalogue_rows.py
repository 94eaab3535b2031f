"""Every row of every experiment: its names, and the settings that decide its trials.

`rows.txt` has the first row of each variant in full, and a digest of all rows of an experiment.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from aeros.experiments.catalogue import PLANTS, EnteredArchitecture, Experiment, Row, catalogue
from tests.reports_in_full import compare_with_section

EXPECTED = Path(__file__).with_name("rows.txt")
ENTRY = EnteredArchitecture("tests.unit.experiments.support.entered:Stubborn", {"patience": 3})
_LONGEST = 40


def _short(value: Any) -> Any:
    """Replace long texts, which are those of files, by a digest."""
    if isinstance(value, dict):
        return {name: _short(one) for name, one in value.items()}
    if isinstance(value, list):
        text = json.dumps(value)
        return value if len(text) < 4 * _LONGEST else f"{len(value)} values, {_digest(text)}"
    return _digest(value) if isinstance(value, str) and len(value) > _LONGEST else value


def _digest(text: str) -> str:
    return f"sha256 {sha256(text.encode()).hexdigest()[:8]}"


def _shown_row(row: Row) -> Iterator[str]:
    names = [getattr(row, one.name) for one in fields(row) if one.name not in {"id", "labels", "condition"}]
    yield f"{row.id} {list(row.labels)} {names}"
    settings = {name: _short(one) for name, one in row.condition.settings.items() if name != "source"}
    yield f"    {row.condition.kind} on {row.condition.plant}: {json.dumps(settings, sort_keys=True)}"


def _shown(one: Experiment) -> Iterator[str]:
    for field in fields(one):
        value = getattr(one, field.name)
        if field.name == "metrics":
            value = [metric.name for metric in value]
        if field.name != "rows":
            yield f"{field.name}: {value}"
    firsts = {row.variant: row for row in reversed(one.rows)}
    for row in one.rows:
        if row is firsts[row.variant]:
            yield from _shown_row(row)
    whole = "\n".join(line for row in one.rows for line in _shown_row(row))
    yield f"{len(one.rows)} rows, {_digest(whole)}"


@pytest.mark.parametrize("plant", PLANTS)
def test_rows_of_every_experiment(plant: str) -> None:
    lines = [line for one in catalogue(plant, [ENTRY]).values() for line in _shown(one)]
    compare_with_section(EXPECTED, plant, "\n".join(lines) + "\n")


def test_an_entered_architecture_is_known_by_the_digest_of_its_file() -> None:
    rows = [row for one in catalogue("symbolic", [ENTRY]).values() for row in one.rows]
    sources = {row.variant: row.condition.settings.get("source", "") for row in rows}
    assert {name for name, source in sources.items() if source} == {"Stubborn"}
    assert len(sources["Stubborn"]) == 64


def test_metrics_are_those_of_the_data() -> None:
    metrics = {one.name: one for experiment in catalogue("symbolic").values() for one in experiment.metrics}
    compare_with_section(EXPECTED, "metrics", "".join(f"{metrics[name]}\n" for name in sorted(metrics)))

"""The page of results is generated of those that are kept, all of it; without any, it is not there.

A report becomes one of them as `docs/results/NAME/` with its `results.json` and `figures/`.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from aeros.experiments.report.document import Figure, document
from aeros.experiments.report.written import FIGURES, RESULTS, page_of_kept
from tests.repo.tree import ROOT, UPDATE

PAGE = ROOT / "docs" / "results.md"
KEPT = sorted(path.parent for path in (ROOT / "docs" / "results").glob(f"*/{RESULTS}"))


def test_the_page_says_what_is_kept_and_nothing_else() -> None:
    expected = page_of_kept(KEPT) if KEPT else None
    found = PAGE.read_text(encoding="utf-8") if PAGE.exists() else None
    if found != expected and expected is not None and UPDATE:
        PAGE.write_text(expected, encoding="utf-8")
        pytest.fail(f"{PAGE} was rewritten")
    assert found == expected


def test_the_figures_are_drawn_of_what_is_kept() -> None:
    drawn = {
        folder / FIGURES / f"{block.name}.svg": block.svg
        for folder in KEPT
        for block in document(json.loads((folder / RESULTS).read_text(encoding="utf-8")))
        if isinstance(block, Figure)
    }
    there: list[Path] = sorted((ROOT / "docs" / "results").glob("**/*.svg"))
    assert there == sorted(drawn)
    assert all(path.read_text(encoding="utf-8") == svg for path, svg in drawn.items())

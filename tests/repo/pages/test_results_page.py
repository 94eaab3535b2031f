"""docs/results.md is generated from all kept results, and does not exist without any.

A report becomes one of them as `docs/results/NAME/`: `results.json`, `report.md`, `figures/` and
`trials.jsonl.xz`.
"""

from __future__ import annotations

import json
import lzma
import re
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from aeros.experiments.catalogue import catalogue, read_data
from aeros.experiments.report.document import document
from aeros.experiments.report.figures import data_digest, figures_of
from aeros.experiments.report.markdown import as_markdown
from aeros.experiments.report.questions import PLACEHOLDER, entries_table
from aeros.experiments.report.results import measure_metric
from aeros.experiments.report.write import FIGURES, REPORT, RESULTS, index_page
from tests.repo.tree import ROOT, UPDATE
from tests.unit.experiments.support.common import premises

PAGE = ROOT / "docs" / "results.md"
ENTRIES = ROOT / "docs" / "how-to" / "enter.md"
KEPT = sorted(path.parent for path in (ROOT / "docs" / "results").glob(f"*/{RESULTS}"))


def test_the_page_says_what_is_kept_and_nothing_else() -> None:
    expected = index_page(KEPT, premises().sources_digest) if KEPT else None
    found = PAGE.read_text(encoding="utf-8") if PAGE.exists() else None
    if found != expected and expected is not None and UPDATE:
        PAGE.write_text(expected, encoding="utf-8")
        pytest.fail(f"{PAGE} was rewritten")
    assert found == expected


def test_the_entries_are_those_of_the_results() -> None:
    kept = {folder.name: json.loads((folder / RESULTS).read_text(encoding="utf-8")) for folder in KEPT}
    page = ENTRIES.read_text(encoding="utf-8")
    before, _, rest = page.partition("<!-- entries -->\n")
    _, _, after = rest.partition("<!-- end of entries -->")
    table = entries_table(kept).markdown
    expected = f"{before}<!-- entries -->\n{table}\n<!-- end of entries -->{after}"
    if UPDATE and page != expected:
        ENTRIES.write_text(expected, encoding="utf-8")
        pytest.fail(f"{ENTRIES} was rewritten")
    assert page == expected


@pytest.mark.parametrize("folder", KEPT, ids=lambda folder: folder.name)
def test_a_report_says_what_its_results_are(folder: Path) -> None:
    results = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
    path, expected = folder / REPORT, as_markdown(document(results, FIGURES))
    if UPDATE and (not path.exists() or path.read_text(encoding="utf-8") != expected):
        path.write_text(expected, encoding="utf-8")
        pytest.fail(f"{path} was rewritten")
    assert path.read_text(encoding="utf-8") == expected


def test_a_text_has_no_number_but_those_of_the_results() -> None:
    for one in read_data("questions.toml")["question"]:
        rest = re.sub(r"`[^`]*`", "", PLACEHOLDER.sub("", one["text"]))
        assert not re.search(r"\d", rest), one["title"]
    assert len(read_data("questions.toml")["question"]) <= 10


def test_the_figures_are_drawn_of_what_is_kept() -> None:
    """The kept bytes come again; another release of Matplotlib may draw otherwise, but of the same data."""
    drawn = {
        folder / FIGURES / f"{figure.name}.svg": figure
        for folder in KEPT
        for experiment in json.loads((folder / RESULTS).read_text(encoding="utf-8"))["experiments"]
        for figure in figures_of(experiment)
    }
    there: list[Path] = sorted((ROOT / "docs" / "results").glob("**/*.svg"))
    assert there == sorted(drawn)
    for path, figure in drawn.items():
        kept = path.read_text(encoding="utf-8")
        if UPDATE and kept != figure.svg:
            path.write_text(figure.svg, encoding="utf-8")
            pytest.fail(f"{path} was rewritten")
        described = re.search(r"<desc>Matplotlib (\S+), data (\S+)</desc>", kept)
        assert described is not None, path
        assert described[2] == data_digest(figure.experiment), path
        assert described[1] != version("matplotlib") or kept == figure.svg, path


@pytest.mark.parametrize("folder", KEPT, ids=lambda folder: folder.name)
def test_the_results_are_counted_of_the_trials_that_are_kept(folder: Path) -> None:
    results = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
    trials: dict[tuple[str, int], dict[str, Any]] = {}
    with lzma.open(folder / "trials.jsonl.xz", "rt", encoding="utf-8") as lines:
        for line in lines:
            one = json.loads(line)
            trials[one["condition"], one["seed"]] = one["found"]
    first, last = results["seeds"]
    metrics = {
        one.number: {metric.name: metric for metric in one.metrics}
        for one in catalogue(results["plant"]).values()
    }
    counted = 0
    for one in results["experiments"]:
        for row in one["rows"]:
            found = [trials[row["digest"], seed] for seed in range(first, last + 1)]
            for name, cell in row["cells"].items():
                again = measure_metric(metrics[one["number"]][name], found)
                assert {part: cell[part] for part in again} == pytest.approx(again), (row["id"], name)
                counted += 1
    # One experiment of seven rows; all others hold several.
    assert counted > (50 if folder.name == "scale" else 100)

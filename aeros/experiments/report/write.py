"""Writer of reports: the data, one HTML page, one Markdown file, and the figures that the latter shows."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from aeros.experiments.catalogue import catalogue
from aeros.experiments.report.document import document, title_of
from aeros.experiments.report.html import as_html
from aeros.experiments.report.markdown import Block, as_markdown, heading, table
from aeros.experiments.report.questions import question_blocks
from aeros.experiments.trial_kinds import condition_digest
from aeros.files import replace_durably

RESULTS: Final = "results.json"
FIGURES: Final = "figures"
REPORT: Final = "report.md"


def is_stale(results: Mapping[str, Any], sources_digest: str) -> bool:
    """Tell if results were made with other code, conditions, modules, scenes or another site.

    A row that the catalogue does not have, as that of an entry, is not compared.

    Args:
        results: of `compute_results`, or older ones, which say nothing of their sources.
        sources_digest: `TrialInputs.sources_digest` of what there is now.

    Returns:
        True if it is not known that a run would give them again.
    """
    if results.get("sources") != sources_digest:
        return True
    now = {row.id: row.condition for one in catalogue(results["plant"]).values() for row in one.rows}
    return any(
        row["digest"] != condition_digest(now[row["id"]], results["premises"])
        for one in results["experiments"]
        for row in one["rows"]
        if row["id"] in now
    )


def index_page(folders: Iterable[Path], sources_digest: str) -> str:
    """Build the page of results: what is kept, and the questions that it answers.

    Reports of lower experiments come first, and of these the one on physics.

    Args:
        folders: of the reports; the page is to stand next to the folder that they are in.
        sources_digest: `TrialInputs.sources_digest` of what there is now.

    Returns:
        Markdown.
    """
    kept = [(folder, json.loads((folder / RESULTS).read_text(encoding="utf-8"))) for folder in folders]
    kept.sort(key=lambda one: (min(of["number"] for of in one[1]["experiments"]), one[1]["plant"]))
    answers = question_blocks({folder.name: results for folder, results in kept})
    rows = [
        _kept_row(f"{folder.parent.name}/{folder.name}", results, is_stale=is_stale(results, sources_digest))
        for folder, results in kept
    ]
    blocks = [
        heading(1, "Results"),
        Block(_INTRODUCTION),
        *answers,
        heading(2, "What is kept"),
        Block(_ABOUT_KEPT),
        table(("report", "trials of each condition", "commit", "state", "data"), rows),
        heading(2, "Run it again"),
        Block(_AGAIN),
    ]
    return as_markdown(blocks)


_INTRODUCTION: Final = (
    "Each question has one table: the value that the paper reports, the exact value, computed of the "
    "manifests that ran, and the measured one with its 95 % interval. Success is what is true in the "
    "simulator, where the scene defines it. The page is generated of the kept results, and a test holds it "
    "to them; [experiments](experiments.md) says how they are made."
)
_ABOUT_KEPT: Final = (
    "A report has all conditions, metrics, tests and figures; its data has every trial. *Stale*: code, "
    "modules, scenes or site have changed since, so a run today need not give the same. A commit with `+` "
    "had changes that were not committed."
)
_AGAIN: Final = (
    "```sh\n"
    "aeros experiment all --out runs/full --resume    # everything, on physics: hours\n"
    "aeros experiment 4 16 --plant symbolic    # minutes\n"
    "aeros experiment 8/aeros/make_dumplings/0.90 --trials 1000    # one condition\n"
    "```"
)


def _kept_row(folder: str, results: Mapping[str, Any], *, is_stale: bool) -> tuple[str, ...]:
    """Build the row of a report, with links to it and to its data."""
    commit = results["environment"]["commit"] or "not known"
    return (
        f"[{title_of(results)}]({folder}/{REPORT})",
        str(results["trials"]),
        f"`{commit[:10]}{'+' * commit.endswith('+')}`" if commit != "not known" else commit,
        "**stale**" if is_stale else "of this code",
        f"[results]({folder}/{RESULTS})",
    )


def write_report(results: Mapping[str, Any], folder: Path) -> None:
    """Write data, pages and figures into a folder.

    Args:
        results: of `compute_results`.
        folder: exists.

    Raises:
        OSError: a file cannot be written.
    """
    blocks = list(document(results, FIGURES))
    replace_durably(folder / RESULTS, (json.dumps(results, indent=1, ensure_ascii=False) + "\n").encode())
    replace_durably(folder / "report.html", as_html(blocks, "AEROS experiments").encode())
    replace_durably(folder / REPORT, as_markdown(blocks).encode())
    (folder / FIGURES).mkdir(exist_ok=True)
    for figure in (block.figure for block in blocks if block.figure is not None):
        replace_durably(folder / FIGURES / f"{figure.name}.svg", figure.svg.encode())

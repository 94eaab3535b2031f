"""Writer of reports: the data, one HTML page, one Markdown file, and the figures that the latter shows."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from aeros.experiments.report.document import document, title_of
from aeros.experiments.report.html import as_html
from aeros.experiments.report.markdown import as_markdown
from aeros.files import replace_durably

RESULTS: Final = "results.json"
FIGURES: Final = "figures"


def is_stale(results: Mapping[str, Any], sources_digest: str) -> bool:
    """Tell if results were made with other code, modules, scenes or another site.

    Args:
        results: of `compute_results`, or older ones, which say nothing of their sources.
        sources_digest: `TrialInputs.sources_digest` of what there is now.

    Returns:
        True if it is not known that a run would give them again.
    """
    return bool(results.get("sources") != sources_digest)


def index_page(folders: Iterable[Path], sources_digest: str) -> str:
    """Build one page of Markdown from the results of several reports.

    Reports of lower experiments come first, and of these the one on physics.

    Args:
        folders: of the reports; the page is to stand next to the folder that they are in.
        sources_digest: `TrialInputs.sources_digest` of what there is now.

    Returns:
        Markdown.
    """
    kept = [(folder, json.loads((folder / RESULTS).read_text(encoding="utf-8"))) for folder in folders]
    kept.sort(key=lambda one: (min(of["number"] for of in one[1]["experiments"]), one[1]["plant"]))
    lines = [
        _index_line(
            f"{folder.parent.name}/{folder.name}", results, is_stale=is_stale(results, sources_digest)
        )
        for folder, results in kept
    ]
    parts = [
        "# Results\n\nGenerated of the results beside it, and held to them by a test; what all of it means, "
        "[experiments](experiments.md) says.\n\n" + "\n".join(lines) + "\n"
    ]
    for folder, results in kept:
        figures = f"{folder.parent.name}/{folder.name}/{FIGURES}"
        parts.append(as_markdown(document(results, figures, top_level=2)))
    return "\n".join(parts)


def _index_line(folder: str, results: Mapping[str, Any], *, is_stale: bool) -> str:
    """Build the line of a report in the page's contents, with a link to its data."""
    title = title_of(results)
    anchor = re.sub(r"[^a-z0-9 -]", "", title.lower()).replace(" ", "-")
    stale = ". **Stale**: code, modules or site have changed since" if is_stale else ""
    return (
        f"- [{title}](#{anchor}), {results['trials']} trials of each condition "
        f"([data]({folder}/{RESULTS})){stale}"
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
    replace_durably(folder / "report.md", as_markdown(blocks).encode())
    (folder / FIGURES).mkdir(exist_ok=True)
    for figure in (block.figure for block in blocks if block.figure is not None):
        replace_durably(folder / FIGURES / f"{figure.name}.svg", figure.svg.encode())

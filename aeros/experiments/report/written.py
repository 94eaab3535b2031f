"""Results → files: the data, one HTML page, one Markdown file, and the figures that the latter shows."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from aeros.durable import replace_file
from aeros.experiments.report.document import Figure, document
from aeros.experiments.report.html import as_html
from aeros.experiments.report.markdown import as_markdown

RESULTS: Final = "results.json"
FIGURES: Final = "figures"


def page_of_kept(folders: Iterable[Path]) -> str:
    """One page of Markdown of the reports in `folders`, which it stands beside; of their results alone."""
    parts = [
        "# Results\n\nGenerated of the results beside it, and held to them by a test; what all of it means, "
        "[experiments](experiments.md) says.\n"
    ]
    for folder in folders:
        results = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
        parts.append(as_markdown(document(results), f"{folder.parent.name}/{folder.name}/{FIGURES}", below=1))
    return "\n".join(parts)


def write_report(results: Mapping[str, Any], folder: Path) -> None:
    """Write all of it into `folder`; raises `OSError`."""
    blocks = list(document(results))
    replace_file(folder / RESULTS, (json.dumps(results, indent=1, ensure_ascii=False) + "\n").encode())
    replace_file(folder / "report.html", as_html(blocks, "AEROS experiments").encode())
    replace_file(folder / "report.md", as_markdown(blocks, FIGURES).encode())
    (folder / FIGURES).mkdir(exist_ok=True)
    for block in blocks:
        if isinstance(block, Figure):
            replace_file(folder / FIGURES / f"{block.name}.svg", block.svg.encode())

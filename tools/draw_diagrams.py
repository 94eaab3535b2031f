"""Draw docs/diagrams/*.mmd as SVG: `pip install mermaidx && python -m tools.draw_diagrams`.

The pages show the SVG files, so that neither the site nor a wheel has to fetch a renderer. Each of them names
the digest of the text that it was drawn from, which a test compares.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parents[1] / "docs" / "diagrams"

_LONG_NUMBER: Final = re.compile(r"-?\d+\.\d{2,}")
_VIEW: Final = re.compile(r'viewBox="([-\d.]+) ([-\d.]+) ([-\d.]+) ([-\d.]+)"')


def source_mark(text: str) -> str:
    """Make the comment that says from which text a picture was drawn.

    Args:
        text: of the diagram, in the language of Mermaid.

    Returns:
        A comment of XML.
    """
    return f"<!-- drawn from sha256:{hashlib.sha256(text.encode()).hexdigest()} -->"


def finish(svg: str, text: str) -> str:
    """Make a picture legible on dark pages too, and shorter.

    Args:
        svg: the picture as drawn.
        text: of the diagram.

    Returns:
        The picture with a white ground, numbers of one decimal, and the mark of its text.

    Raises:
        ValueError: the picture does not say how large it is.
    """
    svg = _LONG_NUMBER.sub(lambda found: f"{float(found[0]):.1f}", svg)
    view = _VIEW.search(svg)
    if view is None:
        raise ValueError("the picture has no viewBox")
    left, top, width, height = view.groups()
    ground = f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="white"/>'
    size = f'width="{float(width):.0f}" height="{float(height):.0f}"'
    svg = svg.replace('width="100%"', size, 1)
    return re.sub(r"(<svg[^>]*>)", lambda tag: f"{tag[1]}{source_mark(text)}{ground}", svg, count=1) + "\n"


def main() -> None:
    """Draw all diagrams whose text has changed."""
    from mermaidx import render  # type: ignore[import-not-found]  # of no extra

    for path in sorted(FOLDER.glob("*.mmd")):
        text = path.read_text(encoding="utf-8")
        picture = path.with_suffix(".svg")
        if picture.exists() and source_mark(text) in picture.read_text(encoding="utf-8"):
            continue
        picture.write_text(finish(render(text, theme="neutral").svg(), text), encoding="utf-8")
        print(picture)


if __name__ == "__main__":
    main()

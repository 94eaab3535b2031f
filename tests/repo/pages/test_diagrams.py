"""Each picture in docs/diagrams was drawn from the text beside it, and a page shows it."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.repo.tree import ROOT
from tools.draw_diagrams import FOLDER, finish, source_mark

TEXTS = sorted(FOLDER.glob("*.mmd"))
PAGES = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md"))


@pytest.mark.parametrize("text", TEXTS, ids=lambda text: text.stem)
def test_a_picture_is_that_of_its_text_and_on_a_page(text: Path) -> None:
    drawn = text.with_suffix(".svg").read_text(encoding="utf-8")
    assert source_mark(text.read_text(encoding="utf-8")) in drawn, "python -m tools.draw_diagrams"
    root = ElementTree.fromstring(drawn)  # noqa: S314  a file of the repository
    assert float(root.attrib["width"]) <= 850, "wider than a page: its words would be too small"
    assert 'fill="white"' in drawn
    assert f"](diagrams/{text.stem}.svg)" in PAGES


def test_all_pictures_have_a_text() -> None:
    assert {path.stem for path in FOLDER.glob("*.svg")} == {path.stem for path in TEXTS}


def test_a_picture_without_a_size_is_refused() -> None:
    with pytest.raises(ValueError, match="no viewBox"):
        finish("<svg></svg>", "flowchart LR")

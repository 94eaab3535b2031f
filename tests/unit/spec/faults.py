"""Diagnostics of a small site and a small module after edits of their files."""

from __future__ import annotations

import shutil
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.render import render_text
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm

CORPUS = Path(__file__).parents[2] / "corpus"
TABLE = CORPUS / "site" / "table.yaml"


def messages_of_site(tmp_path: Path, *edits: tuple[str, str]) -> list[str]:
    """The first line of each diagnostic of the table's site after `edits`."""
    path = tmp_path / "site.yaml"
    path.write_text(_edited(TABLE.read_text(), edits))
    sink = Diagnostics()
    found = load_site(path, sink)
    assert (found is None) == sink.has_errors
    return [render_text(one).splitlines()[0] for one in sink]


def messages_of_module(
    tmp_path: Path, *edits: tuple[str, str], case: str = "waits_less_than_allowed"
) -> list[str]:
    """The first line of each diagnostic of a module that is accepted without `edits`."""
    folder = Path(shutil.copytree(CORPUS / "accepted" / case, tmp_path / "module"))
    manifest = folder / "ecm.yaml"
    manifest.write_text(_edited(manifest.read_text(), edits))
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    sink = Diagnostics()
    found = load_ecm(folder, site, sink)
    assert (found is None) == sink.has_errors
    return [render_text(one).splitlines()[0] for one in sink]


def loaded_module(folder: Path) -> tuple[Ecm | None, list[tuple[str, str]]]:
    """The module of a folder at the table's site, and code and headline of each diagnostic."""
    sink = Diagnostics()
    site = load_site(TABLE, sink)
    assert site is not None
    found = load_ecm(folder, site, sink)
    return None if found is None else found.ecm, [(one.code, one.headline) for one in sink]


def _edited(text: str, edits: tuple[tuple[str, str], ...]) -> str:
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text

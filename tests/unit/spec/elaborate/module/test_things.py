"""Things of a module name its variables and conditions, and each fault is reported at its place."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.spec.expr import terms as t
from tests.unit.spec.faults import CORPUS, loaded_module

MODULE = CORPUS / "accepted" / "things_of_two_kinds"
CRUMB = "{kind: crumb, count: pieces}"


def test_names_are_full_and_conditions_are_terms() -> None:
    ecm, problems = loaded_module(MODULE)
    assert problems == []
    assert ecm is not None
    wanted, crumb = ecm.things["wanted"], ecm.things["crumb"]
    assert (wanted.name, wanted.kind) == ("things_of_two_kinds.wanted", "")
    assert wanted.kind_from == "things_of_two_kinds.piece"
    assert (wanted.position, wanted.count) == ("things_of_two_kinds.place", None)
    assert wanted.held is not None
    assert t.variables_of(wanted.held).keys() == {"things_of_two_kinds.clean", "things_of_two_kinds.level"}
    assert list(wanted.relations) == ["on table", "in tray", "in box"]
    assert (crumb.kind, crumb.position, crumb.count) == ("crumb", None, "things_of_two_kinds.pieces")


@pytest.mark.parametrize(
    ("thing", "code", "words"),
    [
        ("{kind: sponge, position: plaice}", "AE122", "plaice"),
        ("{kind: sponge, position: level}", "AE203", "not a `vec3` in m"),
        ("{kind: sponge, count: level}", "AE203", "not an `int`"),
        ("{kind: sponge, held: level}", "AE203", "expected bool"),
        ("{kind: sponge, on: {tray: claen}}", "AE202", "claen"),
        ("{position: place}", "AE102", "kind"),
        ("{kind: sponge, under: {tray: clean}}", "AE101", "under"),
    ],
)
def test_each_fault_of_a_thing_is_reported(tmp_path: Path, thing: str, code: str, words: str) -> None:
    folder = tmp_path / MODULE.name
    shutil.copytree(MODULE, folder)
    text = (MODULE / "ecm.yaml").read_text()
    assert CRUMB in text
    (folder / "ecm.yaml").write_text(text.replace(CRUMB, thing))
    ecm, problems = loaded_module(folder)
    assert ecm is None
    assert [one for one, headline in problems if words in headline] == [code], problems

"""Modules whose files are text: written whole, and proved alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.experiments.inputs import InputPaths
from aeros.experiments.trials.inline_module import prove_module, write_module_files
from aeros.spec.diagnostics.errors import UserError
from tests.unit.experiments.support.common import ROOT, premises

BASE = ROOT / "docs" / "codes" / "base"
AT_THE_BENCH = replace(premises(), paths=InputPaths("ecms", str(BASE / "site.yaml")))


def test_files_are_written_as_they_are_into_a_new_folder(tmp_path: Path) -> None:
    folder = write_module_files({"ecm.yaml": "id: é\n", "skills.py": ""}, tmp_path / "new")
    assert folder == tmp_path / "new"
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == {
        "ecm.yaml": "id: é\n".encode(),
        "skills.py": b"",
    }
    with pytest.raises(FileExistsError):
        write_module_files({}, folder)


def test_a_module_is_proved_under_the_site_of_the_trials(tmp_path: Path) -> None:
    files = {path.name: path.read_text() for path in (BASE / "tidy").glob("*.*") if path.suffix != ".lock"}
    found = prove_module(write_module_files(files, tmp_path / "tidy"), AT_THE_BENCH)
    assert (list(found.modules), found.site.id) == (["tidy"], "bench")


def test_without_a_site_it_is_the_reference_site() -> None:
    found = prove_module(ROOT / "ecms" / "clean_table", premises())
    assert (list(found.modules), found.site.id) == (["clean_table"], "panda_cell")


def test_a_module_that_is_refused_is_the_users_error(tmp_path: Path) -> None:
    with pytest.raises(UserError):
        prove_module(write_module_files({"ecm.yaml": "id: x\n"}, tmp_path / "bad"), AT_THE_BENCH)

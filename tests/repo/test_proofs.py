"""The folder of theorems is whole; that they are proved, `make test` asks of `aeros prove`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from aeros.spec.theorems.folder import EXPECTED, load_theorem, proofs_folder, theorem_folders
from tests.repo.tree import ROOT, text_of

_FOLDERS = theorem_folders(proofs_folder())
_HEADINGS = ["Claim", "Why it matters", "How it is proved", "Assumptions", "Not modelled", "Mutants"]


def test_the_theorems_are_those_of_this_tree() -> None:
    assert proofs_folder() == ROOT / "proofs"
    assert _FOLDERS


def test_make_test_checks_them() -> None:
    assert re.search(r"^proofs:.*\n(\t.*\n)*\t@\$\(BIN\)/aeros prove$", text_of("Makefile"), re.MULTILINE)


@pytest.mark.parametrize("folder", _FOLDERS.values(), ids=_FOLDERS)
def test_a_theorem_has_all_that_belongs_to_it(folder: Path) -> None:
    theorem = load_theorem(folder)
    headings = re.findall(r"^## (.+)$", (folder / "statement.md").read_text("utf-8"), re.MULTILINE)
    assert headings == _HEADINGS
    assert theorem.mutants
    assert {one.refutes for one in theorem.mutants} <= theorem.obligations.keys()
    wanted = {"statement.md", "theorem.py", EXPECTED, *(f"{name}.smt2" for name in theorem.obligations)}
    assert {path.name for path in folder.iterdir() if path.name != "__pycache__"} == wanted

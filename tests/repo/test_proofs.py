"""The folder of theorems is whole; that they are proved, `make test` asks of `aeros prove`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from aeros.spec.theorems.loop_forms import loop_forms
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.theorem_folder import EXPECTED, load_theorem, proofs_folder, theorem_folders
from proofs.lib.loops import registered_loops
from tests.repo.tree import ROOT, text_of

_FOLDERS = theorem_folders(proofs_folder())
_HEADINGS = ["Claim", "Why it matters", "How it is proved", "Assumptions", "Not modelled", "Mutants"]


def test_the_theorems_are_those_of_this_tree() -> None:
    assert proofs_folder() == ROOT / "proofs"
    assert _FOLDERS


@pytest.mark.parametrize("command", ["prove", "verify ecms/ --check"])
def test_make_test_proves_them_and_that_every_certificate_is_current(command: str) -> None:
    makefile = text_of("Makefile")
    recipe = rf"^proofs:.*\n(\t.*\n)*\t@\$\(BIN\)/aeros {command}$"
    assert re.search(recipe, makefile, re.MULTILINE)
    assert re.search(r"^test:.*\n\t@\$\(MAKE\).* types format lint layers proofs; ", makefile, re.MULTILINE)


@pytest.mark.parametrize("folder", _FOLDERS.values(), ids=_FOLDERS)
def test_a_theorem_has_all_that_belongs_to_it(folder: Path) -> None:
    theorem = load_theorem(folder)
    headings = re.findall(r"^## (.+)$", (folder / "statement.md").read_text("utf-8"), re.MULTILINE)
    assert headings == _HEADINGS
    assert theorem.mutants
    assert {one.refuted_obligation for one in theorem.mutants} <= theorem.obligations.keys()
    wanted = {"statement.md", EXPECTED, *(f"{name}.smt2" for name in theorem.obligations)}
    programs = {path.name for path in folder.glob("*.py")}
    assert "theorem.py" in programs
    assert {path.name for path in folder.iterdir() if path.name != "__pycache__"} == wanted | programs


# Two of a kind stand for any number of them where a loop treats each by itself.


@pytest.mark.parametrize("module", registered_loops())
def test_each_registered_loop_is_one_of_the_code_with_exactly_these_faults(module: str) -> None:
    faults: dict[str, set[str]] = {}
    for form in loop_forms(text_of(f"{module.replace('.', '/')}.py")):
        faults.setdefault(form.place, set()).update(form.faults)
    registered = registered_loops()[module]
    assert {place: {*one["faults"]} for place, one in registered.items()} == {
        place: faults.get(place) for place in registered
    }
    assert all(one["why"].strip() for one in registered.values())


@pytest.mark.parametrize("folder", _FOLDERS.values(), ids=_FOLDERS)
def test_a_theorem_checks_the_loops_of_the_runtime_code_that_it_is_made_of(folder: Path) -> None:
    # The filter is about generated code without loops, and a single agent's only loop waits.
    theorem = load_theorem(folder)
    if folder.name in {"filter", "single_agent"}:
        return
    about_loops = ModuleSource()
    theorem.obligations["loops"](about_loops)
    mutated = {one.module for one in theorem.mutants if one.module.startswith("aeros.runtime.")}
    assert mutated - about_loops.loaded == set()

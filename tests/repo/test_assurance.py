"""The assurance page names every theorem there is, and no other."""

from __future__ import annotations

import re

from aeros.spec.theorems.theorem_folder import load_theorem, proofs_folder, theorem_folders
from tests.repo.tree import ROOT, check_generated, text_of

_PAGE = "docs/assurance.md"


def test_the_table_of_theorems_is_that_of_the_folder() -> None:
    rows = "".join(
        f"| [{name}](../proofs/{name}/statement.md) | {(theorem := load_theorem(folder)).title} "
        f"| {len(theorem.obligations)} | {len(theorem.mutants)} |\n"
        for name, folder in theorem_folders(proofs_folder()).items()
    )
    head = "\n| theorem | claim | obligations | mutants |\n|---|---|---|---|\n"
    check_generated(_PAGE, "theorems", f"{head}{rows}\n")


def test_every_theorem_carries_a_part_of_the_claim() -> None:
    tree = text_of(_PAGE).partition("## Theorems")[0]
    carrying = set(re.findall(r"\(\.\./proofs/(\w+)/statement\.md\)", tree))
    assert carrying == theorem_folders(proofs_folder()).keys()


def test_every_test_that_is_named_is_there() -> None:
    named = re.findall(r"`(tests/[\w/]+\.py)`", text_of(_PAGE))
    assert named
    assert [path for path in named if not (ROOT / path).is_file()] == []


def test_each_assumption_says_what_it_would_break_and_what_watches_it() -> None:
    table = text_of(_PAGE).partition("## Assumptions")[2]
    rows = [line.strip("|").split("|") for line in table.splitlines() if line.startswith("| ")][1:]
    assert rows
    assert [row for row in rows if len(row) != 3 or not all(cell.strip() for cell in row)] == []

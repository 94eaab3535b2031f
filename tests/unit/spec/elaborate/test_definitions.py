"""A definition may have a margin where it reads uncertain values; each fault is reported at its place."""

from __future__ import annotations

import shutil
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.model.ecm import Ecm
from tests.unit.spec.faults import CORPUS, loaded_module

MODULE = CORPUS / "accepted" / "things_of_two_kinds"
STATE = "state:\n"


def loaded(variable: str, folder: Path) -> tuple[Ecm | None, list[tuple[str, str]]]:
    """Load the module with one more variable, which stands below the others."""
    shutil.copytree(MODULE, folder / MODULE.name)
    text = (MODULE / "ecm.yaml").read_text()
    assert text.count("\nthings:\n") == 1
    (folder / MODULE.name / "ecm.yaml").write_text(text.replace("\nthings:\n", f"  {variable}\n\nthings:\n"))
    return loaded_module(folder / MODULE.name)


@pytest.mark.parametrize(
    ("margin", "number"), [("", 0), (", margin: 2", 2), (", margin: 0.5", Fraction(1, 2))]
)
def test_the_margin_is_a_number_of_standard_uncertainties(
    margin: str, number: Fraction, tmp_path: Path
) -> None:
    ecm, problems = loaded(
        f"full: {{type: bool, max_age: 1 s, definition: level >= 50 mm{margin}}}", tmp_path
    )
    assert problems == []
    assert ecm is not None
    assert ecm.definitions["things_of_two_kinds.full"].margin == number


@pytest.mark.parametrize(
    ("variable", "code", "words"),
    [
        ("full: {type: bool, max_age: 1 s, margin: 2}", "AE120", "no definition"),
        ("full: {type: bool, max_age: 1 s, definition: clean, margin: 2}", "AE112", "changes nothing"),
        (
            "full: {type: bool, max_age: 1 s, definition: level >= 1 mm, margin: -1}",
            "AE111",
            "outside its bounds",
        ),
        ("full: {type: int, range: [0, 1], max_age: 1 s, definition: clean}", "AE203", "only a `bool`"),
        ("full: {type: bool, max_age: 1 s, definition: full}", "AE202", "full"),
    ],
)
def test_each_fault_of_a_definition_is_reported(variable: str, code: str, words: str, tmp_path: Path) -> None:
    ecm, problems = loaded(variable, tmp_path)
    assert ecm is None
    assert code in [one for one, headline in problems if words in headline], problems

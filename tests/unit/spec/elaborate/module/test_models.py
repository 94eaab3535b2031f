from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_module

MODEL = """
models:
  patience:
    description: how long to wait
    kind: table
    file: skills.py
    inputs:
      dirt: {unit: "%", range: [0, 100]}
    outputs:
      duration: {unit: ms, range: [0, 9000], shape: [2]}
    bounds:
      - id: short
        given: {dirt: {upper: [50]}}
        then: {duration: {upper: [1, 2]}}

permissions:"""


def messages(tmp_path: Path, old: str, new: str) -> list[str]:
    assert old in MODEL
    return messages_of_module(tmp_path, ("\npermissions:", MODEL.replace(old, new)))


def test_a_model_with_an_interface_and_a_bound_has_no_fault(tmp_path: Path) -> None:
    assert messages_of_module(tmp_path, ("\npermissions:", MODEL)) == []


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("    file: skills.py\n", "", "AE102"),
        ("kind: table", "kind: file", "AE112"),
        ("kind: table", "kind: sheet", "AE110"),
        ("range: [0, 100]", "range: [100, 0]", "AE208"),
        ("      duration:", "      dirt:", "AE121"),
        ("given: {dirt: {", "given: {dust: {", "AE122"),
        ("upper: [1, 2]", "upper: [1, 2, 3]", "AE112"),
        ("upper: [1, 2]", "upper: [1, 10000]", "AE111"),
        ("upper: [1, 2]", "lower: [5], upper: [1, 2]", "AE208"),
        ('unit: "%"', "unit: dirts", "AE207"),
    ],
)
def test_each_fault_of_a_model_is_named(tmp_path: Path, old: str, new: str, fault: str) -> None:
    assert fault in " ".join(messages(tmp_path, old, new))


def test_two_bounds_have_two_names(tmp_path: Path) -> None:
    doubled = "      - id: short\n        then: {}\n      - id: short\n"
    assert "AE120" in " ".join(messages(tmp_path, "      - id: short\n", doubled))


def test_a_skill_uses_models_of_its_module_that_have_a_file(tmp_path: Path) -> None:
    def used(name: str, model: str) -> str:
        uses = ("    risk: medium", f"    models: [{name}]\n    risk: medium")
        (tmp_path / name).mkdir()
        return " ".join(messages_of_module(tmp_path / name, uses, ("\npermissions:", model)))

    assert "`patience2` is not a model of this module" in used("patience2", MODEL)
    notes = "\nmodels:\n  notes: {description: notes, kind: file}\n\npermissions:"
    assert "`notes` has no file to use" in used("notes", notes)

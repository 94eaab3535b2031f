"""Interfaces are elaborated in the module's words, and each fault is reported at its place."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from tests.unit.spec.faults import loaded_module

HELPER = Path(__file__).parents[4] / "corpus" / "accepted" / "capability_with_an_interface" / "helper"


def test_inputs_outputs_and_conditions_are_in_si() -> None:
    ecm, problems = loaded_module(HELPER)
    assert problems == []
    assert ecm is not None
    fetching, weighing = ecm.interfaces["fetching"], ecm.interfaces["weighing"]
    assert (fetching.inputs, fetching.outputs, fetching.precondition) == ({}, {}, None)
    assert fetching.achieves is not None
    assert fetching.achieves.text == "fetched == sponge"
    assert weighing.inputs["force"].range == (Fraction(2), Fraction(8))
    assert weighing.outputs["found"].range == (Fraction(0), Fraction(5))
    assert weighing.achieves is None


@pytest.mark.parametrize(
    ("interface", "code", "words"),
    [
        ("{}", "AE112", "an interface promises something"),
        ("{achieves: fetched == spunge}", "AE202", "spunge"),
        ("{achieves: inputs.force <= 4 N}", "AE202", "no input `force`"),
        ("{precondition: dirt}", "AE203", "expected bool"),
        ("{inputs: {force: {type: real}}}", "AE208", "a number needs a range"),
        ("{outputs: {found: {type: spunge}}}", "AE122", "spunge"),
        ("{achieve: table_tidy}", "AE101", "achieve"),
    ],
)
def test_each_fault_of_an_interface_is_reported(
    tmp_path: Path, interface: str, code: str, words: str
) -> None:
    text = (HELPER / "ecm.yaml").read_text().replace("{achieves: fetched == sponge}", interface)
    folder = tmp_path / "helper"
    folder.mkdir()
    (folder / "ecm.yaml").write_text(text)
    (folder / "skills.py").write_text((HELPER / "skills.py").read_text())
    ecm, problems = loaded_module(folder)
    assert ecm is None
    assert [one for one, headline in problems if words in headline] == [code], problems

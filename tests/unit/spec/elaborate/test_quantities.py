"""Declared quantities: types, units and ranges."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_site

_LOAD = "load: {type: real, unit: kg, range: [0, 5], "


@pytest.mark.parametrize(
    ("declaration", "message"),
    [
        ("type: real, unit: kg, range: [5, 0]", "a range is two numbers, the lower one first"),
        ("type: real, unit: kg", "a number needs a range"),
        ("type: bool, unit: kg", "a bool has no unit"),
        ("type: bool, range: [0, 1]", "a bool has no range"),
        ("type: int, range: [0, 1.5]", "the range of an int ends at whole numbers"),
        ("type: int, unit: kg, range: [0, 1]", "an int is a bare number, without a unit"),
        ("type: reel, unit: kg, range: [0, 1]", "`reel` is not a type"),
        ("type: tools, index: joints", "a family of tools is not supported"),
        ("type: bool, index: jonts", "`jonts` is not a declared enum"),
    ],
)
def test_a_fault_of_a_quantity_is_reported(tmp_path: Path, declaration: str, message: str) -> None:
    (found,) = messages_of_site(tmp_path, (_LOAD, f"load: {{{declaration}, "))
    assert message in found

"""Declared quantities: types, units and ranges."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from tests.unit.spec.faults import TABLE, messages_of_module, messages_of_site

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


def test_a_range_in_degrees_celsius_is_kept_in_kelvin(tmp_path: Path) -> None:
    path = tmp_path / "site.yaml"
    heat = 'heat: {type: real, unit: "°C", range: [-20, 200], sensor: camera, max_age: 1 s}'
    path.write_text(TABLE.read_text().replace(f"  {_LOAD}", f"  {heat}\n  {_LOAD}"))
    site = load_site(path, Diagnostics())
    assert site is not None
    assert site.state["heat"].range == (Fraction("253.15"), Fraction("473.15"))


def test_an_uncertainty_in_degrees_celsius_is_refused_as_it_is_a_difference(tmp_path: Path) -> None:
    found, *_ = messages_of_module(
        tmp_path,
        ("unit: mm, range: [0, 100]", 'unit: "°C", range: [0, 99]'),
        ("uncertainty: 1 mm", "uncertainty: 2 °C"),
        case="measures_its_own_predicate",
    )
    assert "`2 °C` is a point of a scale" in found

"""The vocabulary of a site: enums, constants, volumes, state variables and action kinds."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_site


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (
            ("joints: [shoulder, elbow]", "joints: [shoulder, shoulder]"),
            "`shoulder` is already a member of `joints`",
        ),
        (("tools: [sponge, brush, knife]", "tools: []"), "the enum `tools` has no member"),
        (("slow: {value: 100 mm/s,", "slow: {"), "a constant has either `value` or"),
        (("values: [170, 120]", "values: [170]"), "joints has 2 members, but 1 values are given"),
        (("turn_max: {index: joints", "turn_max: {index: jonts"), "`values` need an `index` that is"),
        (("upper: [600 mm, 400 mm, 500 mm]", "upper: [600 mm, 400 mm]"), "a corner has three coordinates"),
        (("upper: [600 mm, 400 mm,", "upper: [0 mm, 400 mm,"), "the volume `tabletop` is empty"),
        (
            ("risk: low, protective: true", "risk: medium, protective: true"),
            "the protective stop must have low",
        ),
        (("risk: low, protective: true", "risk: low"), "a site has exactly one protective stop; 0"),
        (("{angle: {type: real", "{slow: {type: real"), "`slow` is already a constant"),
    ],
)
def test_a_fault_of_the_vocabulary_is_reported(tmp_path: Path, edit: tuple[str, str], message: str) -> None:
    found = messages_of_site(tmp_path, edit)
    assert any(message in line for line in found), found

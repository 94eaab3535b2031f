"""The safety laser scanners of a site: names, units and bounds are checked."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.area_scanners import AreaScanners
from aeros.spec.text.discovery import reference_site_path

TEXT = reference_site_path().read_text(encoding="utf-8")
HEAD, _, REST = TEXT.partition("area_scanners:\n")
TAIL = REST[REST.index("\n# Errors of the sensors") :]

SECTION = """\
area_scanners:
  measures: human_distance
  source: x
  floor: -300 mm
  height: 200 mm
  field_of_view: 180 deg
  resolution: 1 deg
  range: 5.5 m
  period: 30 ms
  latency: 35 ms
  noise: 20 mm
  allowance: 100 mm
  dropout: 0.25
  scanners:
    west: {at: [-1.6 m, 0.6 m], facing: 90 deg}
"""


def elaborated(tmp_path: Path, section: str) -> tuple[AreaScanners | None, list[str]]:
    path = tmp_path / "panda_cell.yaml"
    path.write_text(HEAD + section + TAIL, encoding="utf-8")
    diagnostics = Diagnostics()
    site = load_site(path, diagnostics)
    found = [f"{one.code}: {one.headline}" for one in diagnostics]
    return (None if site is None else site.area_scanners), found


def test_without_the_section_there_are_none(tmp_path: Path) -> None:
    assert elaborated(tmp_path, "") == (None, [])


def test_numbers_are_in_si_units(tmp_path: Path) -> None:
    found, faults = elaborated(tmp_path, SECTION)
    assert faults == []
    assert found is not None
    assert found.measures == "human_distance"
    assert found[1:-1] == pytest.approx((-0.3, 0.2, pi, pi / 180, 5.5, 0.03, 0.035, 0.02, 0.1, 0.25))
    ((name, *place),) = found.scanners
    assert name == "west"
    assert place == pytest.approx([-1.6, 0.6, pi / 2])


@pytest.mark.parametrize(
    ("line", "other", "fault"),
    [
        ("measures: human_distance", "measures: human_distanc", "AE122: `human_distanc` is not"),
        ("measures: human_distance", "measures: tool_position", "AE204: `tool_position` is not a distance"),
        ("measures: human_distance", "measures: tool_speed", "AE204: `tool_speed` is not a distance"),
        ("height: 200 mm", "height: 0 mm", "AE112: `0 mm` is not above 0"),
        ("height: 200 mm", "height: 200 ms", "AE204: expected a value in m"),
        ("field_of_view: 180 deg", "field_of_view: 400 deg", "AE112: `400 deg` is more than 6.283 rad"),
        ("resolution: 1 deg", "resolution: 0.001 deg", "AE112: `0.001 deg` is less than"),
        ("noise: 20 mm", "noise: -1 mm", "AE112: `-1 mm` is less than 0 m"),
        ("dropout: 0.25", "dropout: 1", "AE112: this number is from 0 to 1"),
        ("    west: {at: [-1.6 m, 0.6 m], facing: 90 deg}", "    {}", "AE112: without a scanner"),
        ("facing: 90 deg", "facing: 90 m", "AE204: expected a value in rad"),
        ("at: [-1.6 m, 0.6 m]", "at: [-1.6 m]", "AE112"),
    ],
)
def test_what_is_wrong_is_reported(tmp_path: Path, line: str, other: str, fault: str) -> None:
    assert line in SECTION
    found, faults = elaborated(tmp_path, SECTION.replace(line, other))
    assert found is None
    assert any(one.startswith(fault) for one in faults), faults


def test_the_plane_of_the_reference_cell_is_high_enough_for_its_rays() -> None:
    """Pilz, operating manual 1005056-EN-01: at least 15 (d - 50 mm), with d the distance of two rays."""
    diagnostics = Diagnostics()
    site = load_site(reference_site_path(), diagnostics)
    assert site is not None
    scanners = site.area_scanners
    assert scanners is not None
    assert scanners.height >= 15.0 * (scanners.range * scanners.step - 0.05)

"""Errors of a site's sensors: names, units and bounds are checked, and absent ones are ideal."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.sensor_errors import (
    AreaScanners,
    CameraErrors,
    OdometryErrors,
    SensorErrors,
    SurveyErrors,
)
from aeros.spec.text.discovery import reference_site_path

TEXT = reference_site_path().read_text(encoding="utf-8")
HEAD, _, REST = TEXT.partition("sensor_errors:\n")
TAIL = REST[REST.index("\n# Pictures that perceivers") :]


def elaborated(tmp_path: Path, section: str) -> tuple[SensorErrors | None, list[str]]:
    path = tmp_path / "panda_cell.yaml"
    path.write_text(HEAD + section + TAIL, encoding="utf-8")
    diagnostics = Diagnostics()
    site = load_site(path, diagnostics)
    found = [f"{one.code}: {one.headline}" for one in diagnostics]
    return (None if site is None else site.sensor_errors), found


def test_without_the_section_sensors_are_ideal(tmp_path: Path) -> None:
    assert elaborated(tmp_path, "") == (SensorErrors(), [])


def test_amounts_are_in_si_units(tmp_path: Path) -> None:
    errors, faults = elaborated(
        tmp_path,
        "sensor_errors:\n"
        "  state:\n"
        "    tool_position:\n"
        "      {noise: 2 mm, bias: 1 mm, resolution: 0.5 mm, latency: 8 ms, dropout: 0.25, source: x}\n"
        "  sensors:\n    press: {noise: 50 mN, source: x}\n"
        "  cameras:\n"
        "    mast: {colour_noise: 2, depth_noise: 3 mm, latency: 20 ms, dropout: 0.5, source: x}\n"
        "  survey: {setup: 2 mm, calibration: 1 mm, noise: 0.5 mm, source: x}\n"
        "  odometry: {scale: 0.01, drift: 4 mm, source: x}\n",
    )
    assert faults == []
    assert errors is not None
    assert errors.state["tool_position"] == (LENGTH, 0.002, 0.001, 0.0005, 0.008, 0.25)
    assert errors.sensors["press"].noise == 0.05
    assert errors.cameras["mast"] == CameraErrors(2.0, 0.003, 0.02, 0.5)
    assert errors.survey == SurveyErrors(0.002, 0.001, 0.0005)
    assert errors.odometry == OdometryErrors(0.01, 0.004)


@pytest.mark.parametrize(
    ("section", "fault"),
    [
        (
            "  state: {tool_postion: {noise: 1 mm, source: x}}\n",
            "AE122: `tool_postion` is not",
        ),
        ("  state: {tool_position: {noise: 1 N, source: x}}\n", "AE204: expected a value in m, found"),
        (
            "  state: {tool_position: {noise: -1 mm, source: x}}\n",
            "AE112: an error of a sensor",
        ),
        ("  state: {tool_position: {dropout: 1.5, source: x}}\n", "AE112: this number is from 0 to 1"),
        ("  sensors: {scale: {noise: 1 N, source: x}}\n", "AE122: `scale` is not a sensor"),
        ("  cameras: {roof: {colour_noise: 1, source: x}}\n", "AE122: `roof` is not a camera"),
        ("  odometry: {scale: 0.6, drift: 1 mm, source: x}\n", "AE112: this number is from 0 to 0.5"),
    ],
)
def test_wrong_names_units_and_numbers_are_refused(tmp_path: Path, section: str, fault: str) -> None:
    errors, faults = elaborated(tmp_path, "sensor_errors:\n" + section)
    assert errors is None
    assert any(one.startswith(fault) for one in faults), faults


def test_the_reference_site_gives_each_kind_of_sensor_errors() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    errors = site.sensor_errors
    assert {"joint_position", "joint_torque", "contact_force", "finger_gap", "base_position"} <= set(
        errors.state
    )
    assert set(errors.cameras) == set(site.cameras)
    assert all(one.latency > 0.0 and one.dropout > 0.0 for one in errors.cameras.values())
    assert min(errors.survey) > 0.0 < min(errors.odometry)


# Safety laser scanners.

BEFORE, _, AFTER = TEXT.partition("area_scanners:\n")
BEHIND = AFTER[AFTER.index("\n# Errors of the sensors") :]

SECTION = """\
area_scanners:
  measures: human_distance
  source: x
  floor: -300 mm
  height: 200 mm
  field_of_view: 180 deg
  resolution: 0.5 deg
  range: 5.5 m
  period: 30 ms
  latency: 35 ms
  noise: 20 mm
  allowance: 100 mm
  dropout: 0.25
  scanners:
    west: {at: [-1.6 m, 0.6 m], facing: 90 deg}
"""


def scanners(tmp_path: Path, section: str) -> tuple[AreaScanners | None, list[str]]:
    path = tmp_path / "panda_cell.yaml"
    path.write_text(BEFORE + section + BEHIND, encoding="utf-8")
    diagnostics = Diagnostics()
    site = load_site(path, diagnostics)
    found = [f"{one.code}: {one.headline}" for one in diagnostics]
    return (None if site is None else site.area_scanners), found


def test_without_scanners_there_are_none(tmp_path: Path) -> None:
    assert scanners(tmp_path, "") == (None, [])


def test_scanners_are_in_si_units(tmp_path: Path) -> None:
    found, faults = scanners(tmp_path, SECTION)
    assert faults == []
    assert found is not None
    assert found.measures == "human_distance"
    assert found[1:-1] == pytest.approx((-0.3, 0.2, pi, pi / 360, 5.5, 0.03, 0.035, 0.02, 0.1, 0.25))
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
        ("resolution: 0.5 deg", "resolution: 0.001 deg", "AE112: `0.001 deg` is less than"),
        ("resolution: 0.5 deg", "resolution: 0.8 deg", "AE112: at 5.5 m rays are 77 mm apart, so a leg may"),
        ("range: 5.5 m", "range: 8 m", "AE112: at 8 m rays are 70 mm apart, so a leg may pass"),
        ("noise: 20 mm", "noise: -1 mm", "AE112: `-1 mm` is less than 0 m"),
        ("dropout: 0.25", "dropout: 1", "AE112: this number is from 0 to 1"),
        ("    west: {at: [-1.6 m, 0.6 m], facing: 90 deg}", "    {}", "AE112: without a scanner"),
        ("facing: 90 deg", "facing: 90 m", "AE204: expected a value in rad"),
        ("at: [-1.6 m, 0.6 m]", "at: [-1.6 m]", "AE112"),
    ],
)
def test_wrong_scanners_are_reported(tmp_path: Path, line: str, other: str, fault: str) -> None:
    assert line in SECTION
    found, faults = scanners(tmp_path, SECTION.replace(line, other))
    assert found is None
    assert any(one.startswith(fault) for one in faults), faults


@pytest.mark.parametrize("name", ["panda_cell", "iiwa_cell"])
def test_the_plane_of_a_reference_cell_is_high_enough_for_its_rays(name: str) -> None:
    """Pilz, operating manual 1005056-EN-01: at least 15 (d - 50 mm), with d the distance of two rays."""
    diagnostics = Diagnostics()
    site = load_site(reference_site_path().with_name(f"{name}.yaml"), diagnostics)
    assert site is not None
    scanners = site.area_scanners
    assert scanners is not None
    assert scanners.height >= 15.0 * (scanners.range * scanners.step - 0.05)

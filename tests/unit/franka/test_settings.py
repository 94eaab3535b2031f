from pathlib import Path

import pytest

from aeros.franka.settings import read_settings
from aeros.sim.shipped_files import shipped_files
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.wired_arm.settings import SettingsError

CELL = shipped_files("sites")["fr3_cell"]


def site_of(text: str, folder: Path) -> Site:
    file = folder / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    diagnostics = Diagnostics()
    site = load_site(file, diagnostics)
    diagnostics.raise_if_errors()
    assert site is not None
    return site


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Site:
    return site_of(CELL.read_text(), tmp_path_factory.mktemp("cell"))


def test_thresholds_and_patience_are_those_of_the_site(cell: Site) -> None:
    settings = read_settings({"AEROS_FRANKA": " 172.16.0.2 "}, cell)
    assert settings.address == "172.16.0.2"
    assert (settings.is_real_time, settings.has_hand) == (True, True)
    assert settings.torques == (30.0, 30.0, 27.0, 24.0, 15.0, 12.0, 9.0)
    assert settings.forces == (40.0, 40.0, 40.0, 30.0, 30.0, 30.0)
    assert (settings.patience, settings.start_tolerance) == (0.02, 0.0024)


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        ({}, "set AEROS_FRANKA to its address"),
        (
            {"AEROS_FRANKA": "a", "AEROS_FRANKA_REALTIME": "yes"},
            "AEROS_FRANKA_REALTIME is `yes`: it is `enforce`",
        ),
        ({"AEROS_FRANKA": "a", "AEROS_FRANKA_HAND": "1"}, "AEROS_FRANKA_HAND is `1`: it is `yes` or `no`"),
    ],
)
def test_a_wrong_setting_is_reported(cell: Site, environment: dict[str, str], message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        read_settings(environment, cell)


@pytest.mark.parametrize(
    ("was", "instead", "message"),
    [
        ("  collision_moment:", "  other_moment:", r"add the constant `collision_moment` \(Nm, one value"),
        (
            "values: [30, 30, 27, 24, 15, 12, 9]",
            "values: [30, 30, 27, 24, 15, 12, 0]",
            "values, one for each joint",
        ),
        ("  late_ticks: {period: 5 ms, in_a_row: 3, longest: 20 ms}\n", "", "add `motion.late_ticks`"),
    ],
)
def test_a_site_that_does_not_state_its_limits_is_refused(
    tmp_path: Path, was: str, instead: str, message: str
) -> None:
    text = CELL.read_text()
    assert was in text
    with pytest.raises(SettingsError, match=message):
        read_settings({"AEROS_FRANKA": "a"}, site_of(text.replace(was, instead), tmp_path))

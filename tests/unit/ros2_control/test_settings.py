"""Settings that are missing or wrong are refused with what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.ros2_control.settings import read_settings
from aeros.wired_arm.settings import SettingsError
from tests.repo.tree import ROOT
from tests.unit.franka.test_settings import site_of
from tests.unit.ros2_control.foreign.stub import JOINTS, VARIABLES

CELL = ROOT / "docs/examples/ros2_control/cell.yaml"


def test_names_come_from_the_environment_and_thresholds_from_the_site(tmp_path: Path) -> None:
    settings = read_settings(VARIABLES, site_of(CELL.read_text(), tmp_path), 7)
    assert settings.controller == "/joint_trajectory_controller"
    assert settings.joints == JOINTS
    assert settings.states == "/joint_states"
    assert settings.patience == 0.2
    # Twice 10 mm at 0.99 m.
    assert settings.path_tolerance[0] == pytest.approx(0.02 / 0.99)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"AEROS_ROS2_CONTROL": ""}, "no controller is named: set AEROS_ROS2_CONTROL"),
        ({"AEROS_ROS2_CONTROL": "controller"}, "AEROS_ROS2_CONTROL is `controller`: it is a name of ROS 2"),
        ({"AEROS_ROS2_CONTROL_STATES": "joint states"}, "AEROS_ROS2_CONTROL_STATES is `joint states`"),
        (
            {"AEROS_ROS2_CONTROL_JOINTS": "a,b"},
            "has 2 different names, and .* has 7 joints",
        ),
        ({"AEROS_ROS2_CONTROL_JOINTS": "a,a,b,c,d,e,f"}, "has 6 different names"),
        ({"AEROS_ROS2_CONTROL_JOINTS": ""}, "has 0 different names"),
    ],
)
def test_a_wrong_name_is_refused(tmp_path: Path, changes: dict[str, str], words: str) -> None:
    with pytest.raises(SettingsError, match=words):
        read_settings({**VARIABLES, **changes}, site_of(CELL.read_text(), tmp_path), 7)


def test_a_site_that_does_not_bound_late_ticks_is_refused(tmp_path: Path) -> None:
    lines = CELL.read_text().splitlines()
    text = "\n".join(one for one in lines if not one.strip().startswith("late_ticks:"))
    with pytest.raises(SettingsError, match="does not bound late ticks"):
        read_settings(VARIABLES, site_of(text, tmp_path), 7)

"""The plant is found under its name, and says what it lacks."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.ros2_control.provider import ROS2_CONTROL, open_control
from aeros.session.plant_provider import PlantRequest, load_provider
from aeros.wired_arm.process import ProcessError
from aeros.wired_arm.settings import SettingsError
from tests.unit.franka.test_settings import site_of
from tests.unit.ros2_control.foreign.stub import VARIABLES
from tests.unit.ros2_control.test_settings import CELL


def test_the_plant_is_found_by_its_name() -> None:
    assert load_provider("ros2-control") is ROS2_CONTROL
    assert ROS2_CONTROL.runs_in_real_time


def test_without_a_controller_nothing_is_opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("AEROS_ROS2_CONTROL", raising=False)
    with pytest.raises(SettingsError, match="no controller is named"):
        open_control(PlantRequest(site_of(CELL.read_text(), tmp_path), None, {}, 0))


def test_without_rclpy_it_says_how_to_have_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name, value in VARIABLES.items():
        monkeypatch.setenv(name, value)
    (tmp_path / "rclpy.py").write_text("raise ImportError('no rclpy here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(ProcessError, match="source a ROS 2 distribution, or install the extra `ros2`"):
        open_control(PlantRequest(site_of(CELL.read_text(), tmp_path), None, {}, 0))

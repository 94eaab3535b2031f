from contextlib import closing
from pathlib import Path

import pytest

from aeros.franka.provider import FRANKA, open_franka
from aeros.session.plant_provider import PlantRequest, load_provider
from aeros.spec.scenes.load import load_scene
from aeros.wired_arm.settings import SettingsError
from tests.unit.franka.stub.arms import use_stub
from tests.unit.franka.test_settings import CELL, site_of


def test_the_plant_is_found_by_its_name() -> None:
    assert load_provider("franka") is FRANKA


def test_the_arm_stands_where_the_scene_puts_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    use_stub(monkeypatch)
    monkeypatch.setenv("AEROS_FRANKA", "stub")
    monkeypatch.setenv("AEROS_FRANKA_REALTIME", "ignore")
    monkeypatch.setenv("AEROS_FRANKA_HAND", "no")
    site = site_of(CELL.read_text(), tmp_path)
    for scene in (None, load_scene("bare")):
        with closing(open_franka(PlantRequest(site, scene, {}, 0))) as plant:
            assert plant.observe()["base_position"].value == (0.0, 0.0, 0.0)
            assert set(plant.observe()) <= set(site.state)


def test_without_an_address_nothing_is_opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("AEROS_FRANKA", raising=False)
    with pytest.raises(SettingsError, match="no robot is named"):
        open_franka(PlantRequest(site_of(CELL.read_text(), tmp_path), None, {}, 0))

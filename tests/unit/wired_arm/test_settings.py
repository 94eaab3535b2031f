"""Settings that plants for wired arms have in common."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.sim.shipped_files import shipped_files
from aeros.spec.diagnostics.errors import UserError
from aeros.wired_arm.settings import SettingsError, base_of, load_site_file, watch_bounds
from tests.shipped_scenes import shipped_scene

CELL = shipped_files("sites")["fr3_cell"]


def test_bounds_are_those_of_the_site() -> None:
    site = load_site_file(CELL)
    bounds = watch_bounds(site)
    assert site.motion is not None
    assert bounds.start_tolerance == float(site.motion.start_tolerance)
    assert bounds.patience > 0.0
    for motion in (None, replace(site.motion, late_ticks=None)):
        with pytest.raises(SettingsError, match=r"does not bound late ticks: add `motion\.late_ticks`"):
            watch_bounds(replace(site, motion=motion))


def test_a_file_that_is_no_site_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    file.write_text("aeros: 1")
    with pytest.raises((SettingsError, UserError)):
        load_site_file(file)


def test_the_base_is_where_the_scene_mounts_the_robot() -> None:
    assert base_of(None) == (0.0, 0.0, 0.0)
    scene = shipped_scene("bare")
    assert base_of(scene) == ((0.0, 0.0, 0.0) if scene.robot is None else scene.robot.base)

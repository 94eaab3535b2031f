"""Meshes of shipped robots are in the frames of their joints; those of another robot are not shown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aeros.sim.film import link_models as module
from aeros.sim.film.link_models import link_models
from aeros.sim.robot.robot_file import read_robot
from tests.unit.sim.robot.standing_arms.two_armed_robots import two_pandas

pytest.importorskip("pybullet_data")


@pytest.mark.parametrize("name", ["kuka_iiwa14", "panda"])
def test_each_mesh_of_a_shipped_robot_is_around_its_hull_and_not_much_beyond(name: str) -> None:
    robot = read_robot(name)
    models = link_models(robot)
    with_meshes = ["foot", *(f"link{number}" for number in range(1, 8)), "hand", "fingers"]
    # The seventh hull of the iiwa has the adapter for the hand, too.
    assert sorted(hull.link for hull in models) == sorted(with_meshes if name == "panda" else with_meshes[:7])
    for hull in robot.body.hulls:
        if (model := models.get(hull)) is not None:
            assert "Apache-2.0" in model.origin or "BSD-2-Clause" in model.origin
            points = np.concatenate([np.array(one.corners) for one in model.surfaces])
            hulls = np.array(hull.corners)
            # Hulls leave out 5 mm of the meshes, and have 6 mm of collision meshes beyond them.
            assert np.allclose(points.min(axis=0), hulls.min(axis=0), atol=0.006)
            assert np.allclose(points.max(axis=0), hulls.max(axis=0), atol=0.006)
            assert all(max(map(max, one.triangles)) < len(one.corners) for one in model.surfaces)


def test_meshes_of_a_standing_arm_are_where_its_hulls_are() -> None:
    robot = two_pandas()
    models = link_models(robot)
    assert len(models) == len(robot.body.hulls) == 20
    for hull, model in models.items():
        points = np.concatenate([np.array(one.corners) for one in model.surfaces])
        corners = np.array(hull.corners)
        assert np.allclose(points.min(axis=0), corners.min(axis=0), atol=0.01)
        assert np.allclose(points.max(axis=0), corners.max(axis=0), atol=0.01)


def test_meshes_of_another_robot_are_not_shown() -> None:
    robot = read_robot("panda")
    other = replace(robot, meshes=read_robot("kuka_iiwa14").meshes)
    assert link_models(other) == {}
    assert link_models(replace(robot, meshes=None)) == {}


def test_a_robot_whose_meshes_cannot_be_read_has_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "arm.urdf"
    monkeypatch.setattr(module, "stock_urdf_file", lambda _: file)
    assert link_models(read_robot("panda")) == {}
    file.write_text("<robot>")
    assert link_models(read_robot("panda")) == {}

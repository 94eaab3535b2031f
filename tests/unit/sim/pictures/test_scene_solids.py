"""Pictures of whole scenes are those that PyBullet makes, but for the robot's details."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest

from aeros.runtime.ports import CameraPicture
from aeros.sim.kinematic.plant import make_plant as make_kinematic
from aeros.sim.physics import make_plant
from aeros.sim.pictures.scene_solids import robot_solids
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.robot.panda import PANDA


def arrays(picture: CameraPicture) -> tuple[np.ndarray, np.ndarray]:
    depth = np.frombuffer(picture.depth or b"", np.float32).reshape(picture.height, picture.width)
    return np.frombuffer(picture.rgb, np.uint8).reshape(*depth.shape, 3).astype(float), depth


@pytest.mark.physics
@pytest.mark.parametrize(("scene", "camera"), [("table", "table_top"), ("dumpling_bench", "overhead")])
def test_both_simulators_see_the_same_start(scene: str, camera: str) -> None:
    exact = make_kinematic(shipped_scene(scene), 3).pictures()[camera]
    with closing(make_plant(shipped_scene(scene), 3)) as plant:
        rendered = plant.pictures()[camera]
    assert (exact.view, exact.time) == (rendered.view, rendered.time)
    (rgb, depth), (other_rgb, other_depth) = arrays(exact), arrays(rendered)
    is_alike = np.abs(depth - other_depth) < 0.005
    assert is_alike.mean() > 0.96
    assert np.median(np.abs(depth - other_depth)) < 1e-4
    assert np.abs(rgb - other_rgb)[is_alike].mean() < 12


def test_the_robots_links_reach_from_its_foot_to_its_fingers() -> None:
    joints = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
    placed = list(robot_solids(PANDA, joints, (1.0, 2.0, 0.5)))
    assert len(placed) == 10
    lowest = min(one.middle[2] - one.solid.radius for one in placed)
    assert lowest < 0.5 < max(one.middle[2] for one in placed)
    assert all(np.hypot(one.middle[0] - 1.0, one.middle[1] - 2.0) < 1.0 for one in placed)

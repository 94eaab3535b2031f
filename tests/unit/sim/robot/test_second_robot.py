"""The second robot: chain and shapes are those of its URDF, and shipped skills reach their goals with it."""

from __future__ import annotations

from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

import aeros
from aeros.kinematic_chain import frames_of
from aeros.sim.bullet.client import DATA, bullet
from aeros.sim.physics import make_bullet_engine, make_mujoco_engine, make_plant
from aeros.sim.robot.kinematics import forward_kinematics, solve_ik_one
from aeros.sim.robot.robot_file import read_robot, robot_of
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from tests.modules.robot import Robot
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.ground_truth import is_done
from tools.urdf_shapes import read_mesh

ARM = read_robot("kuka_iiwa14")
FOLDER = Path(DATA) / "kuka_iiwa"

Points = np.ndarray[Any, Any]

pytestmark = pytest.mark.physics


@cache
def frames_at(q: tuple[float, ...]) -> list[tuple[Points, Points]]:
    """Positions and rotations of the URDF's links, as PyBullet has them."""
    client = bullet.connect(bullet.DIRECT)
    body = bullet.loadURDF(str(FOLDER / "model.urdf"), useFixedBase=True, physicsClientId=client)
    for joint, angle in enumerate(q):
        bullet.resetJointState(body, joint, angle, physicsClientId=client)
    states = bullet.getLinkStates(body, range(7), computeForwardKinematics=1, physicsClientId=client)
    found = [(np.zeros(3), np.eye(3))]
    for state in states:
        turned = np.array(bullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
        found.append((np.array(state[4]), turned))
    bullet.disconnect(client)
    return found


def vertices(number: int) -> Points:
    """Vertices of a link's meshes in the frame of its joint, by PyBullet's and our frames at one posture."""
    q = (0.0,) * 7
    points = np.concatenate([read_mesh(FOLDER / "meshes" / f"link_{number}.{end}") for end in ("stl", "obj")])
    place, turned = frames_at(q)[number]
    frame = frames_of(ARM.mountings, q)[number]
    in_base = points @ turned.T + place
    ours: Points = (in_base - np.array(frame.origin)) @ np.array((frame.x, frame.y, frame.z)).T
    return ours


def test_the_chain_is_that_of_the_urdf() -> None:
    chance = np.random.default_rng(0)
    for q in chance.uniform(ARM.limits.lowest, ARM.limits.highest, (20, 7)):
        place, turned = frames_at(tuple(q.tolist()))[7]
        tool = place + turned @ np.array([0.0, 0.0, ARM.hand.flange + ARM.hand.tool])
        p_tool, _, _ = forward_kinematics(ARM, q[None, :])
        # The frame of joint 7 is 81 mm beyond joint 6 in both.
        assert p_tool[0] == pytest.approx(tool, abs=1e-6)


@pytest.mark.parametrize("number", range(8))
def test_capsules_and_hulls_hold_the_meshes(number: int) -> None:
    points = vertices(number)
    name = "foot" if number == 0 else f"link{number}"
    (capsule,) = (one for one in ARM.capsules if one.link == name)
    a, b = np.array(capsule.a), np.array(capsule.b)
    share = np.clip((points - a) @ (b - a) / max(float((b - a) @ (b - a)), 1e-12), 0.0, 1.0)
    assert np.linalg.norm(points - a - share[:, None] * (b - a), axis=1).max() <= capsule.radius
    (hull,) = (one for one in ARM.body.hulls if one.link == name)
    corners = np.array(hull.corners)
    assert hull.radius <= 0.005
    for point in points[ConvexHull(points).vertices]:
        weights, _ = nnls(np.vstack((corners.T, np.full(len(corners), 1e3))), np.append(point, 1e3))
        assert np.linalg.norm(corners.T @ (weights / weights.sum()) - point) <= hull.radius


def test_exempt_pairs_of_links_are_joined_or_apart() -> None:
    hulls = {hull.link: hull for hull in ARM.body.hulls}
    chance = np.random.default_rng(1)
    for q in chance.uniform(ARM.limits.lowest, ARM.limits.highest, (100, 7)):
        frames = frames_of(ARM.mountings, q.tolist())
        for first, second in ARM.body.exempt_pairs:
            one, other = hulls[first], hulls[second]
            if other.joint == one.joint + 1:
                continue
            a, b = (np.array([frames[hull.joint].to_base(c) for c in hull.corners]) for hull in (one, other))
            away = np.linalg.norm(a[:, None, :] - b[None, :, :], axis=2).min()
            assert away > one.radius + other.radius + 0.015, (first, second)


@pytest.mark.parametrize("yaw", [-1.0, 0.0, 1.5])
def test_inverse_kinematics_reaches_the_bench(yaw: float) -> None:
    target = np.array([0.5, 0.2, 0.05])
    q = solve_ik_one(ARM, target, yaw, ARM.postures.ready)
    assert q is not None
    p_tool, r_tool, _ = forward_kinematics(ARM, q[None, :])
    assert p_tool[0] == pytest.approx(target, abs=1e-4)
    assert np.arctan2(r_tool[0, 1, 0], r_tool[0, 0, 0]) == pytest.approx(yaw, abs=1e-4)


def test_its_site_allows_no_more_than_it_can() -> None:
    diagnostics = Diagnostics()
    site = load_site(Path(aeros.__file__).parent / "sites" / "iiwa_cell.yaml", diagnostics)
    assert site is not None, list(diagnostics)
    assert robot_of(site) is ARM


@pytest.mark.parametrize(
    ("engine", "module", "scene", "skills"),
    [
        ("bullet", "fetch_object", "fetch", ("navigate", "detect", "grasp", "deliver")),
        pytest.param(
            "mujoco",
            "fetch_object",
            "fetch",
            ("navigate", "detect", "grasp", "deliver"),
            marks=pytest.mark.deep,
        ),
        pytest.param(
            "bullet at 480 Hz",
            "fetch_object",
            "fetch",
            ("navigate", "detect", "grasp", "deliver"),
            marks=pytest.mark.deep,
        ),
        pytest.param(
            "bullet", "make_dumplings", "dumpling_bench", ("prepare", "wrap", "boil"), marks=pytest.mark.deep
        ),
    ],
)
def test_shipped_skills_reach_the_goal_by_truth(
    engine: str, module: str, scene: str, skills: tuple[str, ...]
) -> None:
    steps = 2 if engine == "bullet at 480 Hz" else 1
    made = make_mujoco_engine() if engine == "mujoco" else make_bullet_engine(steps)
    with closing(make_plant(shipped_scene(scene), 3, robot=ARM, engine=made)) as plant:
        robot = Robot(module, plant)
        assert not is_done(plant)
        for skill in skills:
            assert robot.run(skill) is None
        assert is_done(plant)

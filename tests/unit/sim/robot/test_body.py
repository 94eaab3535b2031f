from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from aeros.kinematic_chain import frames_of, mounting_of
from aeros.sim.bullet.client import DATA
from aeros.sim.robot.body import Capsule, enclosing_balls
from tests.unit.sim.robot.panda import CAPSULES, FLANGE, PANDA_BODY, Q_MAX, Q_MIN


def _vertices(mesh: str, kind: str = "collision") -> np.ndarray[Any, Any]:
    files = [Path(DATA) / "franka_panda" / "meshes" / one / f"{mesh}.obj" for one in (kind, "collision")]
    lines = next(file for file in files if file.exists()).read_text().splitlines()
    return np.array([[float(x) for x in line.split()[1:4]] for line in lines if line.startswith("v ")])


def _mesh_of(link: str, kind: str = "collision") -> np.ndarray[Any, Any]:
    """Vertices of the link's collision meshes in the frame of its joint; fingers at every opening."""
    if link == "foot":
        return _vertices("link0", kind)
    if link not in ("hand", "fingers"):
        return _vertices(link, kind)
    if link == "hand":
        points = _vertices("hand", kind)
    else:
        one = _vertices("finger", kind) + np.array([0.0, 0.0, 0.0584])
        openings = [one + np.array([0.0, gap, 0.0]) for gap in (0.0, 0.02, 0.04)]
        points = np.concatenate([*openings, *(other * np.array([-1.0, -1.0, 1.0]) for other in openings)])
    c = math.sqrt(0.5)
    x, y, z = points.T
    return np.stack((c * (x + y), c * (y - x), FLANGE + z), axis=1)


@pytest.mark.physics
@pytest.mark.parametrize("capsule", CAPSULES, ids=lambda capsule: capsule.link)
def test_each_capsule_holds_its_links_mesh_and_its_balls_hold_the_capsule(capsule: Any) -> None:
    a, b = np.array(capsule.a), np.array(capsule.b)
    points = _mesh_of(capsule.link)
    along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    assert np.linalg.norm(points - a - along[:, None] * (b - a), axis=1).max() <= capsule.radius
    chance = np.random.default_rng(0)
    way = chance.normal(size=(5000, 3))
    way *= capsule.radius / np.linalg.norm(way, axis=1)[:, None]
    skin = a + chance.uniform(0.0, 1.0, (5000, 1)) * (b - a) + way
    balls = [ball for ball in PANDA_BODY.balls if ball.link == capsule.link]
    away = [np.linalg.norm(skin - np.array(ball.centre), axis=1) - ball.radius for ball in balls]
    assert np.min(away, axis=0).max() <= 1e-12


def test_a_capsule_is_covered_by_balls_half_a_radius_apart() -> None:
    # 1 m long and 0.5 m thick: gaps of at most 0.25 m, so 4 of them; each ball reaches the rim between two.
    balls = enclosing_balls(Capsule("link", 3, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.5))
    assert [ball.centre for ball in balls] == [(0.0, 0.0, share) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert {(ball.link, ball.joint) for ball in balls} == {("link", 3)}
    assert {ball.radius for ball in balls} == {math.hypot(0.5, 0.125)}


def test_gaps_are_rounded_up_and_a_ball_is_a_capsule_too() -> None:
    longer = enclosing_balls(Capsule("link", 0, (1.0, 2.0, 3.0), (2.1, 2.0, 3.0), 0.5))
    assert len(longer) == 6
    assert longer[-1].centre == pytest.approx((2.1, 2.0, 3.0))
    ball = enclosing_balls(Capsule("link", 0, (1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 0.5))
    assert {one.centre for one in ball} == {(1.0, 2.0, 3.0)}
    assert {one.radius for one in ball} == {0.5}


def test_the_body_has_seven_joints_and_a_ball_for_every_capsule() -> None:
    assert len(PANDA_BODY.dh_rows) == 7
    assert {ball.link for ball in PANDA_BODY.balls} == {capsule.link for capsule in CAPSULES}
    joints = {capsule.link: capsule.joint for capsule in CAPSULES}
    assert [joints[link] for link in ("foot", "link1", "link7", "hand", "fingers")] == [0, 1, 7, 7, 7]


def test_the_hand_is_turned_by_45_degrees_and_beyond_the_flange() -> None:
    (hand,) = (capsule for capsule in CAPSULES if capsule.link == "hand")
    # (0, -0.079, 0.021) turned by -45 degrees: x = y = -0.079 times the square root of a half.
    assert hand.a == pytest.approx((-0.0558614, -0.0558614, FLANGE + 0.021), abs=1e-6)


# Hulls.


def _away(point: np.ndarray[Any, Any], corners: np.ndarray[Any, Any]) -> float:
    """Distance of a point from one convex combination of the corners: no less than from their hull."""
    weights, _ = nnls(np.vstack((corners.T, np.full(len(corners), 1e3))), np.append(point, 1e3))
    return float(np.linalg.norm(corners.T @ (weights / weights.sum()) - point))


def _visual_mesh_of(link: str) -> np.ndarray[Any, Any]:
    """Vertices of the convex hull of the link's meshes for pictures, or of those for collisions."""
    points = _mesh_of(link, "visual")
    outermost: np.ndarray[Any, Any] = points[ConvexHull(points).vertices]
    return outermost


@pytest.mark.physics
@pytest.mark.parametrize("hull", PANDA_BODY.hulls, ids=lambda hull: hull.link)
def test_each_hull_holds_its_links_meshes_and_protrudes_by_its_radius_at_most(hull: Any) -> None:
    # A hull is convex: as it holds all vertices, it holds the meshes and their convex hull.
    corners = np.array(hull.corners)
    collision, visual = _mesh_of(hull.link), _visual_mesh_of(hull.link)
    assert max(_away(point, corners) for point in (*collision, *visual)) <= hull.radius <= 0.005
    both = np.concatenate((collision, visual))
    middle = both.mean(axis=0)
    faces = ConvexHull(both).equations
    assert (faces[:, :3] @ middle + faces[:, 3]).max() < 0.0
    assert (corners @ faces[:, :3].T + faces[:, 3]).max() <= 1e-4  # rounded to 0.1 mm


@pytest.mark.physics
def test_hulls_move_with_their_links_and_cover_every_link() -> None:
    assert [(hull.link, hull.joint) for hull in PANDA_BODY.hulls] == [
        (capsule.link, capsule.joint) for capsule in CAPSULES
    ]


def test_exempt_pairs_are_joined_or_never_nearer_than_their_hulls_say() -> None:
    joined = {
        ("foot", "link1"),
        *((f"link{number}", f"link{number + 1}") for number in range(1, 7)),
    }
    assert joined <= {*PANDA_BODY.exempt_pairs}
    frames = [mounting_of(row) for row in PANDA_BODY.dh_rows]
    apart = [pair for pair in PANDA_BODY.exempt_pairs if pair not in joined]
    assert len(apart) == 12
    hulls = {hull.link: hull for hull in PANDA_BODY.hulls}
    chance = np.random.default_rng(0)
    for q in chance.uniform(Q_MIN, Q_MAX, (150, 7)):
        posture = frames_of(frames, q.tolist())
        for first, second in apart:
            a, b = (
                np.array([posture[hulls[link].joint].to_base(corner) for corner in hulls[link].corners])
                for link in (first, second)
            )
            assert _gap(a, b) - hulls[first].radius - hulls[second].radius > 0.015, (first, second)


def _gap(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> float:
    """Lower bound of the distance of two convex hulls, by the best of some directions."""
    best, way = 0.0, b.mean(axis=0) - a.mean(axis=0)
    for _ in range(40):
        along_a, along_b = a @ way, b @ way
        best = max(best, float(along_b.min() - along_a.max()) / float(np.linalg.norm(way)))
        step = b[along_b.argmin()] - a[along_a.argmax()] - way
        way = way + np.clip(-(way @ step) / max(float(step @ step), 1e-18), 0.0, 1.0) * step
    return best

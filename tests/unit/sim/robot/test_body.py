from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.sim.bullet.client import DATA
from aeros.sim.robot.body import CAPSULES, PANDA_BODY, Capsule, enclosing_balls
from aeros.sim.robot.kinematics import FLANGE


def _vertices(mesh: str) -> np.ndarray[Any, Any]:
    lines = (Path(DATA) / "franka_panda" / "meshes" / "collision" / f"{mesh}.obj").read_text().splitlines()
    return np.array([[float(x) for x in line.split()[1:4]] for line in lines if line.startswith("v ")])


def _mesh_of(link: str) -> np.ndarray[Any, Any]:
    """Vertices of the link's collision meshes in the frame of its joint; fingers at every opening."""
    if link == "foot":
        return _vertices("link0")
    if link not in ("hand", "fingers"):
        return _vertices(link)
    if link == "hand":
        points = _vertices("hand")
    else:
        one = _vertices("finger") + np.array([0.0, 0.0, 0.0584])
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

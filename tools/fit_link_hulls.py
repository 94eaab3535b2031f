"""Fit a hull to each link of PyBullet's Panda and find the pairs of links that need no check.

Writes `aeros/robots/panda_hulls.json`. A link's hull has some vertices of its meshes as corners, and as
its radius the greatest distance of any vertex from their convex hull. So it encloses the meshes, their convex
hull included, and protrudes from that by its radius at most. The meshes are both of each link: the one for
collisions and the one for pictures; the fingers are enclosed at every gap.

A pair of links is exempt if one joint joins them, so that they touch, or if they keep apart by more than
`_EXEMPT_DISTANCE` wherever the joints between them are inside their limits. That is shown by dividing the
joints' ranges until a direction separates the links in each part.

Run with `.venv/bin/python tools/fit_link_hulls.py`; it takes about a minute.
"""

from __future__ import annotations

import json
from itertools import combinations
from math import sqrt
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from aeros.kinematic_chain import Row
from aeros.runtime.motion.link_distance import HullPair, PostureRange, hull_pairs
from aeros.runtime.ports import Hull, RobotBody
from aeros.sim.bullet.client import DATA
from aeros.sim.robot.robot_file import reference_robot

Points = np.ndarray[Any, np.dtype[np.float64]]
Rows = tuple[Row, ...]

_OUTPUT: Final = Path(__file__).parent.parent / "aeros" / "robots" / "panda_hulls.json"

_MAX_RADIUS: Final = 0.005
"""Radius at which a hull is close enough to its link, m."""

_EXEMPT_DISTANCE: Final = 0.015
"""Distance of links that can never meet, m: more than any clearance between links."""

_MAX_BOXES: Final = 4000
"""Greatest number of parts of the joints' ranges to look at for one pair."""

_FINGER_MOUNT: Final = 0.0584
"""Height of the fingers above the flange, m (panda.urdf)."""

_MAX_GAP: Final = 0.04
"""Greatest way of one finger, m (panda.urdf)."""

LINKS: Final = {
    "foot": (0, "link0"),
    **{f"link{joint}": (joint, f"link{joint}") for joint in range(1, 8)},
    "hand": (7, "hand"),
    "fingers": (7, "finger"),
}
"""Number of joints that move each link, and the name of its meshes."""


def mesh_vertices(link: str) -> Points:
    """Read the vertices of a link's meshes.

    Args:
        link: the link's name.

    Returns:
        The vertices (n, 3) in the frame of the link's joint, m.
    """
    _, mesh = LINKS[link]
    files = [
        Path(DATA) / "franka_panda" / "meshes" / kind / f"{mesh}.obj" for kind in ("collision", "visual")
    ]
    lines = [line for file in files if file.exists() for line in file.read_text().splitlines()]
    points = np.array([[float(x) for x in line.split()[1:4]] for line in lines if line.startswith("v ")])
    if link == "fingers":
        one = points + np.array([0.0, 0.0, _FINGER_MOUNT])
        open_ = one + np.array([0.0, _MAX_GAP, 0.0])
        turned = np.array([-1.0, -1.0, 1.0])
        points = np.concatenate((one, open_, turned * one, turned * open_))
    if link in ("hand", "fingers"):  # mounted turned by -45 degrees
        x, y, z = points.T
        points = np.stack(
            ((x + y) * sqrt(0.5), (y - x) * sqrt(0.5), reference_robot().hand.flange + z), axis=1
        )
    return points


def distance_from_hull(point: Points, corners: Points) -> float:
    """Bound the distance of a point from a convex hull from above.

    Args:
        point: (3,), m.
        corners: (n, 3), m.

    Returns:
        Its distance from one convex combination of the corners, the nearest one but for rounding, m.
    """
    weights, _ = nnls(np.vstack((corners.T, np.full(len(corners), 1e3))), np.append(point, 1e3))
    return float(np.linalg.norm(corners.T @ (weights / weights.sum()) - point))


def fit_hull(link: str, joint: int, vertices: Points) -> Hull:
    """Fit a hull: add the vertex that is farthest from the hull so far, until it is near enough.

    Args:
        link: the link's name.
        joint: number of joints that move it.
        vertices: vertices of its meshes in the frame of that joint (n, 3), m.

    Returns:
        The hull; it holds all vertices.
    """
    vertices = vertices[ConvexHull(vertices).vertices]
    middle = vertices.mean(axis=0)
    corners = vertices[[int(np.linalg.norm(vertices - middle, axis=1).argmax())]]
    while True:
        away = np.array([distance_from_hull(one, corners.round(4)) for one in vertices])
        if away.max() <= _MAX_RADIUS - 1e-4:
            radius = float(np.ceil(away.max() * 1e4) / 1e4)
            rounded = [tuple(float(x) for x in corner) for corner in corners.round(4)]
            return Hull(link, joint, tuple((x, y, z) for x, y, z in rounded), radius)
        corners = np.vstack((corners, vertices[away.argmax()]))


def _meet(body: RobotBody, pair: HullPair, lowest: Points, highest: Points) -> bool:
    """Return False if the two links are shown to be apart inside the limits of the joints between them."""
    joints, between = len(lowest), range(pair.inner.joint, pair.outer.joint)
    middle, width = (lowest + highest) / 2.0, (highest - lowest) / 2.0
    boxes = [(middle, np.array([w if joint in between else 0.0 for joint, w in enumerate(width)]))]
    for _ in range(_MAX_BOXES):
        if not boxes:
            return False
        middle, width = boxes.pop()
        posture = PostureRange(body, middle.tolist(), [0.0] * joints, width.tolist())
        gap = posture.find_gap(pair, _EXEMPT_DISTANCE)
        if gap is None:
            continue
        if gap < _EXEMPT_DISTANCE:
            return True
        step = np.where(np.arange(joints) == width.argmax(), width / 2.0, 0.0)
        boxes += [(middle - step, width - step), (middle + step, width - step)]
    return True


def write_hulls(
    output: Path, rows: Rows, hulls: tuple[Hull, ...], lowest: Points, highest: Points
) -> tuple[tuple[str, str], ...]:
    """Find the exempt pairs, and write them with the hulls.

    Args:
        output: the file.
        rows: modified Denavit-Hartenberg parameters of the chain.
        hulls: of the links: `foot`, those of the arm from the base outwards, then the others.
        lowest: lowest joint positions (joints,), rad.
        highest: highest joint positions (joints,), rad.

    Returns:
        The names of the links of each exempt pair.
    """
    body = RobotBody(rows, (0.0,) * 3, (), hulls)
    chain = hulls[: len(rows) + 1]
    joined = {(a.link, b.link) for a, b in combinations(chain, 2) if b.joint == a.joint + 1}
    exempt = []
    for pair in hull_pairs(body):
        names = (pair.inner.link, pair.outer.link)
        if names in joined:
            exempt.append({"links": names, "reason": "joined"})
        elif not _meet(body, pair, lowest, highest):
            exempt.append({"links": names, "reason": "never meet"})
    listed = [
        {"link": hull.link, "joint": hull.joint, "radius": hull.radius, "corners": hull.corners}
        for hull in hulls
    ]
    for hull in hulls:
        print(f"{hull.link:8} {len(hull.corners):3} corners, radius {1000 * hull.radius:.1f} mm")
    lines = ",\n  ".join(json.dumps(one) for one in listed)
    pairs = ",\n  ".join(json.dumps(one) for one in exempt)
    output.write_text(f'{{"hulls": [\n  {lines}\n], "exempt_pairs": [\n  {pairs}\n]}}\n')
    print(f"{len(exempt)} exempt pairs; wrote {output}")
    return tuple((inner, outer) for inner, outer in (one["links"] for one in exempt))


def main() -> None:
    """Fit all hulls, find the exempt pairs and write both."""
    panda = reference_robot()
    hulls = tuple(fit_hull(link, LINKS[link][0], mesh_vertices(link)) for link in LINKS)
    write_hulls(_OUTPUT, panda.body.dh_rows, hulls, panda.limits.lowest, panda.limits.highest)


if __name__ == "__main__":
    main()

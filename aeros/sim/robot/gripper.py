"""Read the gripper of a robot file, and check that the enclosures of its fingers hold them at every gap."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product
from typing import Final

import numpy as np

from aeros.runtime.ports import Hull, Vec3
from aeros.sim.robot.body import Capsule
from aeros.sim.robot.model import HandMount, LinkMass, TwoFingers
from aeros.spec.declared.robots.robot import Hand, Link
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.text.fields import NumberField

_ROUNDING: Final = 1e-6
"""Distance by which a corner of a finger may be outside its enclosure, as numbers are rounded, m."""

_STEPS: Final = 200
"""Steps of the search for the point of a hull that is nearest to a corner."""

_UNITY: Final = 10.0
"""Weight, m, with which the shares of a convex combination have to sum up to 1."""


def read_gripper(hand: Hand, diagnostics: Diagnostics) -> TwoFingers | None:
    """Read masses and finger shapes of a hand.

    Args:
        hand: the hand of a decoded robot file.
        diagnostics: for problems; the result is then of no use.

    Returns:
        The gripper; None for the Franka Hand, which simulators have.
    """
    if hand.model == "franka_hand":
        for one in (hand.palm, hand.finger):
            if one is not None:
                diagnostics.error(
                    "AE208",
                    "simulators have their own shapes of the `franka_hand`",
                    one.span,
                    help=("remove `palm` and `finger`, or write `model: two_fingers`",),
                )
        return None
    if hand.palm is None or hand.finger is None:
        diagnostics.error(
            "AE208",
            "a hand of `two_fingers` lacks `palm` or `finger`",
            hand.span,
            help=("give mass, centre and inertia of the palm, and mass and boxes of a finger",),
        )
        return None
    boxes = tuple((point_of(one.edges), point_of(one.at)) for one in hand.finger.boxes)
    for declared, (edges, middle) in zip(hand.finger.boxes, boxes, strict=True):
        if min(edges) <= 0.0:
            text, cure = "a box of the finger has an edge that is not above 0 m", "write lengths above 0"
            diagnostics.error("AE208", text, declared.span, help=(cure,))
        elif middle[1] - edges[1] / 2.0 < -_ROUNDING:
            text = f"a box of the finger reaches {edges[1] / 2.0 - middle[1]:g} m beyond y = 0"
            cure = "the pads of closed fingers meet at y = 0; give the boxes of the finger on the side of +y"
            diagnostics.error("AE208", text, declared.span, help=(cure,))
    if hand.finger.mass.value <= 0:
        text = f"`{hand.finger.mass.node.text}` is not above 0"
        diagnostics.error("AE208", text, hand.finger.mass.span, help=("write a number above 0",))
    return TwoFingers(read_mass(hand.palm, diagnostics), float(hand.finger.mass.value), boxes)


def read_mass(link: Link, diagnostics: Diagnostics) -> LinkMass:
    """Read the mass of a link or a palm.

    Args:
        link: the decoded link.
        diagnostics: for problems; the result is then of no use.

    Returns:
        Its mass.
    """
    if link.mass.value <= 0 or min(one.value for one in link.inertia[:3]) <= 0:
        text = "a link without mass or moment of inertia"
        diagnostics.error("AE208", text, link.span, help=("give it more than 0",))
    inertia = tuple(float(part.value) for part in link.inertia)
    return LinkMass(float(link.mass.value), point_of(link.centre), inertia)


def point_of(numbers: tuple[NumberField, ...]) -> Vec3:
    """Convert three numbers to a point.

    Args:
        numbers: x, y and z.

    Returns:
        The point.
    """
    x, y, z = (float(one.value) for one in numbers)
    return (x, y, z)


def finger_corners(mount: HandMount, gripper: TwoFingers) -> Iterator[tuple[Vec3, ...]]:
    """Yield the corners of each box of both fingers, closed and open.

    Args:
        mount: the mounting of the hand.
        gripper: its gripper.

    Yields:
        Of a box of one finger, its 16 corners in the frame of the last joint, m: the box sweeps their hull.
    """
    c, s = float(np.cos(mount.turn)), float(np.sin(mount.turn))
    ways, signs = (0.0, mount.widest_gap / 2.0), (-0.5, 0.5)
    for (edges, middle), side in product(gripper.boxes, (1.0, -1.0)):
        corners = []
        for way, *outwards in product(ways, signs, signs, signs):
            x, y, z = (at + sign * edge for at, sign, edge in zip(middle, outwards, edges, strict=True))
            x, y = side * x, side * (y + way)
            corners.append((c * x - s * y, s * x + c * y, z + mount.flange))
        yield tuple(corners)


def finger_outside(
    mount: HandMount, capsules: tuple[Capsule, ...], hulls: tuple[Hull, ...]
) -> tuple[str, float] | None:
    """Find an enclosure of the link `fingers` that does not hold them at every gap.

    A box counts as held if one capsule, and one hull, has all corners that it reaches: each is convex, so it
    holds the box at every gap. Several that have some of the corners each may leave out what is between.

    Args:
        mount: the mounting of the hand.
        capsules: capsules of all links; those of the fingers are looked at.
        hulls: hulls of all links; likewise.

    Returns:
        `capsule` or `hull`, and the greatest distance of a corner outside the one that is nearest to holding
        its box, m; None if all boxes are held, or the hand is the Franka Hand.
    """
    if mount.gripper is None:
        return None
    boxes = [*finger_corners(mount, mount.gripper)]
    of_capsules = [partial(_outside_capsule, capsule=one) for one in capsules if one.link == "fingers"]
    of_hulls = [partial(_outside_hull, hull=one) for one in hulls if one.link == "fingers"]
    for name, distances in (("capsule", of_capsules), ("hull", of_hulls)):
        found = max(min(max(map(distance, box)) for distance in distances) for box in boxes)
        if found > _ROUNDING:
            return name, found
    return None


def _outside_capsule(point: Vec3, capsule: Capsule) -> float:
    """Return the distance of a point outside a capsule, m; below 0 inside."""
    a, b, p = (np.array(one) for one in (capsule.a, capsule.b, point))
    along = b - a
    share = float(np.clip((p - a) @ along / max(float(along @ along), 1e-18), 0.0, 1.0))
    return float(np.linalg.norm(p - a - share * along)) - capsule.radius


def _outside_hull(point: Vec3, hull: Hull) -> float:
    """Return a bound from above of the distance of a point outside a hull, m; below 0 if it is inside.

    Of all convex combinations of the corners it takes the nearest one, found as least squares with shares
    that are not negative. Source: C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, chapter 23.
    """
    corners = np.array(hull.corners) - np.array(point)
    matrix = np.vstack((corners.T, np.full(len(corners), _UNITY)))
    wanted = np.array((0.0, 0.0, 0.0, _UNITY))
    shares, used = np.zeros(len(corners)), np.zeros(len(corners), dtype=bool)
    for _ in range(_STEPS):
        slope = np.where(used, -np.inf, matrix.T @ (wanted - matrix @ shares))
        if slope.max() <= 1e-12:
            break
        used[int(slope.argmax())] = True
        while used.any():
            best = np.zeros(len(corners))
            best[used] = np.linalg.lstsq(matrix[:, used], wanted, rcond=None)[0]
            if (best[used] > 0.0).all():
                break
            too_low = used & (best <= 0.0)
            part = (shares[too_low] / np.maximum(shares[too_low] - best[too_low], 1e-300)).min()
            shares = shares + part * (best - shares)
            used &= shares > 1e-15
            shares = np.where(used, shares, 0.0)
        shares = best
    return float(np.linalg.norm(shares @ corners)) / float(shares.sum()) - hull.radius

"""Read a gripper from a URDF: palm, and two fingers that move in parallel, as a robot file has them.

Each shape of a finger becomes the box around it. The URDF has a base link, from whose origin z leads out of
the hand, and two prismatic joints on it, along x or along y; one of them may mimic the other. Names do not
matter. The fingers have to be the same, turned by 180 degrees about z.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple
from xml.etree import ElementTree

import numpy as np

from tools.fit_link_hulls import Points
from tools.urdf_shapes import axis_of, number_of, read_urdf, transform
from tools.urdf_tree import UrdfTree, link_mass, link_of, mass_of_parts, read_tree, rigid_part, shapes_of

_ALIKE: Final = 0.002
"""Greatest difference of both fingers, m."""

_BEFORE_THE_TIPS: Final = 0.009
"""Distance of the tool centre point from the ends of the fingers, m: as of the Franka Hand."""

_ALONG: Final = 0.999
"""Least part of a finger's way along x or y."""


class GripperParts(NamedTuple):
    """A gripper in the frame of the hand: origin on the flange, z out of it, the fingers' way along y.

    Attributes:
        palm: points whose hull holds the palm (n, 3), m.
        fingers: corners of both fingers, closed and open (n, 3), m.
        tool: distance of the tool centre point from the flange, m: 9 mm before the fingertips.
        lines: the lines of `hand` in a robot file that describe the gripper.
    """

    palm: Points
    fingers: Points
    tool: float
    lines: list[str]


class _Finger(NamedTuple):
    """A finger of a URDF: its boxes in the frame of the hand with the pads at y = 0, each (2, 3), m.

    Attributes:
        boxes: as above.
        gaps: least and greatest distance of the pads, m.
        mass: kg.
    """

    boxes: list[Points]
    gaps: tuple[float, float]
    mass: float


def read_gripper_urdf(path: Path) -> GripperParts:
    """Read a gripper.

    Args:
        path: its URDF.

    Returns:
        Its parts.

    Raises:
        SystemExit: it has no two fingers that move in parallel and are alike.
    """
    tree = read_tree(read_urdf(path))
    children = {link_of(one, "child") for some in tree.joints.values() for one in some}
    bases = [name for name in tree.links if name not in children]
    if len(bases) != 1 or not children <= tree.links.keys():
        raise SystemExit(f"{path}: the links of a gripper are one tree; give each joint links that are there")
    palm, moving = rigid_part(tree, bases[0], np.eye(4), set())
    kinds = {one.get("type") for one, _ in moving}
    if len(moving) != 2 or kinds != {"prismatic"}:
        found = ", ".join(f"`{one.get('name')}` ({one.get('type')})" for one, _ in moving) or "none"
        raise SystemExit(
            f"{path}: the joints of the palm that move are {found}. AEROS has grippers of two fingers, each "
            "on a prismatic joint of the palm; suction and fingers that swing are not supported"
        )
    quarter = _quarter_turn(*moving[0], path)
    first, second = (_finger(one, place, tree, path, quarter) for one, place in moving)
    if first.boxes[0][:, 1].mean() < 0.0:
        first, second = second, first
    turned = [np.sort(box * (-1.0, -1.0, 1.0), axis=0) for box in second.boxes]
    pairs = zip(sorted(map(_key, first.boxes)), sorted(map(_key, turned)), strict=False)
    ends = np.abs(np.subtract(first.gaps, second.gaps)).max()
    if (
        ends > _ALIKE
        or len(first.boxes) != len(turned)
        or any(np.abs(np.subtract(*pair)).max() > _ALIKE for pair in pairs)
    ):
        raise SystemExit(
            f"{path}: the fingers and their ways are not the same, turned by 180 degrees about z of the palm"
        )
    if first.gaps[0] > _ALIKE:
        raise SystemExit(
            f"{path}: the closed fingers are {1e3 * first.gaps[0]:g} mm apart. AEROS has grippers whose pads "
            "meet; correct the limits, or the shapes of the pads"
        )
    points = np.concatenate(shapes_of(palm, tree, path))
    boxes = first.boxes
    tool = round(float(max(box[1, 2] for box in boxes)) - _BEFORE_THE_TIPS, 4)
    if tool <= 0.0:
        raise SystemExit(f"{path}: the fingers do not lead out of the palm along z; turn its link")
    lines = [
        f"  tool: {1e3 * tool:g} mm",
        f"  widest_gap: {1e3 * first.gaps[1]:g} mm",
        "  palm:",
    ]
    held = mass_of_parts([(name, quarter @ place) for name, place in palm], tree, "the palm of the gripper")
    lines += [f"    mass: {held.mass:g}", f"    centre: {held.centre}", f"    inertia: {held.inertia}"]
    lines += ["  finger:", f"    mass: {first.mass:g}", "    boxes:"]
    for box in boxes:
        edges, middle = (np.round(one, 5) + 0.0 for one in (box[1] - box[0], box.mean(axis=0)))
        middle[1] = max(middle[1], edges[1] / 2.0)
        lines.append(f"      - {{edges: {edges.tolist()}, at: {middle.tolist()}}}")
    corners = np.concatenate(
        [_corners(box + np.array((0.0, way, 0.0))) for box in boxes for way in (0.0, first.gaps[1] / 2.0)]
    )
    both = np.concatenate((corners, corners * (-1.0, -1.0, 1.0)))
    return GripperParts(transform(quarter, points), both, tool, lines)


def _key(box: Points) -> list[float]:
    found: list[float] = box.ravel().tolist()
    return found


def _outer_boxes(boxes: list[Points]) -> list[Points]:
    """Leave out boxes inside another one, as shapes for pictures often are in those for collisions."""
    found: list[Points] = []
    for box in sorted(boxes, key=lambda one: -float(np.prod(one[1] - one[0]))):
        if not any((one[0] <= box[0] + 1e-6).all() and (box[1] <= one[1] + 1e-6).all() for one in found):
            found.append(box)
    return found


def _corners(box: Points) -> Points:
    return np.array([(x, y, z) for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])


def _quarter_turn(joint: ElementTree.Element, place: Points, path: Path) -> Points:
    """Return the turn about z (4, 4) that lays the way of the fingers along y."""
    x, y, _ = place[:3, :3] @ axis_of(joint)
    if abs(y) > _ALONG:
        return np.eye(4)
    if abs(x) > _ALONG:
        turn: Points = np.eye(4)
        turn[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
        return turn
    raise SystemExit(f"{path}: the fingers move neither along x nor along y of the palm; turn its link")


def _finger(
    joint: ElementTree.Element,
    place: Points,
    tree: UrdfTree,
    path: Path,
    quarter: Points,
) -> _Finger:
    part, moving = rigid_part(tree, link_of(joint, "child"), quarter @ place, set())
    limit, mimic = joint.find("limit"), joint.find("mimic")
    if moving or limit is None:
        raise SystemExit(
            f"{path}: the finger of `{joint.get('name')}` has joints of its own, or no `<limit>`"
        )
    if mimic is not None and abs(number_of(mimic, "multiplier", "1")) != 1.0:
        raise SystemExit(
            f"{path}: the fingers move by different ways; give `<mimic>` a `multiplier` of 1 or -1"
        )
    shapes = shapes_of(part, tree, path)
    boxes = _outer_boxes([np.array((points.min(axis=0), points.max(axis=0))) for points in shapes])
    way = float((quarter @ place)[1, :3] @ axis_of(joint))
    side = float(np.sign(np.mean([box[:, 1].mean() for box in boxes])))
    shifts = [way * number_of(limit, end, "0") for end in ("lower", "upper")]
    inner = min(float((side * box[:, 1]).min()) for box in boxes)
    least, most = sorted(2.0 * (inner + side * shift) for shift in shifts)
    mass = sum(link_mass(tree.links[name]) for name, _ in part)
    if mass <= 0.0:
        raise SystemExit(
            f"{path}: the finger of `{joint.get('name')}` has no mass; give its link an `<inertial>`"
        )
    if most <= 0.0:
        raise SystemExit(f"{path}: the fingers never part; correct the limits of `{joint.get('name')}`")
    # Shapes that overlap at the lower end cannot: the pads have met before.
    met = np.array((0.0, -side * inner, 0.0))
    return _Finger([box + met for box in boxes], (max(least, 0.0), most), mass)

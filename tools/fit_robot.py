"""Make the parts of a robot file that come from a URDF: chain, masses, a ready posture, capsules and hulls.

    .venv/bin/python -m tools.fit_robot URDF NAME FLANGE TURN [ADAPTER] [--gripper URDF]

It prints `chain`, `ready`, `lean`, `search`, `links` and `capsules` of the robot file, and writes
`NAME_hulls.json` into the current folder. With a gripper it prints the parts of `hand` that come from its
URDF, too; without one the hand is the Franka Hand.

The URDF has one chain of revolute and prismatic joints without branches. What fixed joints hold is part of
the link that holds it: shapes and masses count. With a negative FLANGE the hand is on the side to which the
last axis does not point; then the axis is reversed, and with it the sign of that joint's positions. The
modified Denavit-Hartenberg parameters of the chain have the zero posture of the URDF: a row whose x is not
the link's there gets a `zero`. The base's frame is that of the URDF, so the first axis has to be normal to
its x; another URDF is refused: turn its base link.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Callable, Sequence
from math import atan2, copysign, cos, hypot, isfinite, pi, sin
from pathlib import Path
from typing import Final, NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.optimize import least_squares, minimize

from aeros.kinematic_chain import PRISMATIC, Row, frames_of, is_prismatic, mounting_of, zero_angle
from aeros.runtime.motion.link_distance import PostureRange, hull_pairs
from aeros.runtime.ports import RobotBody
from aeros.sim.robot.robot_file import reference_robot
from tools.fit_gripper import GripperParts, read_gripper_urdf
from tools.fit_link_hulls import Points, Rows, fit_hull, write_hulls
from tools.fit_link_hulls import mesh_vertices as hand_vertices
from tools.search_postures import count_lines, search_postures
from tools.urdf_shapes import axis_of, number_of, read_urdf
from tools.urdf_tree import Moving, Parts, UrdfTree, link_of, mass_of_parts, read_tree, rigid_part, shapes_of

_TOLERANCE: Final = 1e-6

_MOVING: Final = ("revolute", "continuous", "prismatic")
"""Types of joints of a chain."""

_NO_CHAIN: Final = "the URDF is not one chain of revolute and prismatic joints"

_PARALLEL: Final = 2e-5
"""Angle below which two axes count as parallel, rad: URDF files round pi to 3.1416."""

_ADAPTER_RADIUS: Final = 0.04
"""Radius of what holds the hand, m."""

_READY_PLACES: Final = (
    *((0.45, 0.4), (0.35, 0.4), (0.3, 0.3), (0.6, 0.5)),
    *((0.5, 0.15), (0.4, 0.05), (0.3, 0.1), (0.5, -0.1), (0.7, 0.15), (0.8, 0.4)),
)
"""Places of the tool in the ready posture, ahead and up, m; the first that the arm reaches is taken."""

_TRIES: Final = 30
"""Postures from which the ready posture is looked for."""

_ROOM: Final = 0.05
"""Room of the ready posture inside the limits, rad or m; a fourth of the joint's way if that is less."""

_CLEARANCE: Final = 0.01
"""Distance that links keep from each other, m, as `motion` of the sites asks for."""

_FARTHEST_FLANGE: Final = 1.0
"""Greatest distance of the hand from the last joint, m: one beyond it is in a wrong unit."""

_MARGIN: Final = 0.0005
"""Room of a capsule around its link, m: its numbers are rounded to 0.1 mm."""


class Joint(NamedTuple):
    """A joint of a URDF.

    Attributes:
        child: name of the link that it moves.
        place: pose of its frame in the frame before it (4, 4), m.
        axis: its axis in its frame (3,).
        lowest: lowest position, rad or m.
        highest: highest position, rad or m.
        slides: True if it is prismatic.
        part: that link and what is fixed to it, each with its pose in that link's frame.
    """

    child: str
    place: Points
    axis: Points
    lowest: float
    highest: float
    slides: bool = False
    part: Parts = ()


def read_chain(root: ElementTree.Element) -> tuple[Parts, list[Joint]]:
    """Read the chain of a URDF.

    Args:
        root: the element `robot`.

    Returns:
        The link on which the first joint is, with what is fixed to it and the poses in its frame; and the
        joints that move from there outwards.

    Raises:
        SystemExit: a link has several such joints or one of another type, a joint follows another one, the
            chain does not begin at one link, a prismatic joint has no limits, or a lowest position is not
            below the highest.
    """
    tree = read_tree(root)
    bases, seen = tree.roots(), set[str]()
    if len(bases) != 1:
        found = ", ".join(f"`{name}`" for name in bases) or "no link"
        raise SystemExit(f"{_NO_CHAIN}: it begins at {found}")
    foot, moving = rigid_part(tree, bases[0], np.eye(4), seen)
    joints: list[Joint] = []
    while moving:
        joint, place = _only_joint(moving)
        if not joints:
            stand = dict(foot)[link_of(joint, "parent")]
            foot = [(name, np.linalg.inv(stand) @ one) for name, one in foot]
            foot.sort(key=lambda one: one[0] != link_of(joint, "parent"))
            place = np.linalg.inv(stand) @ place
        child = link_of(joint, "child")
        part, moving = rigid_part(tree, child, np.eye(4), seen)
        slides = joint.get("type") == "prismatic"
        joints.append(Joint(child, place, axis_of(joint), *_range_of(joint), slides, part))
    if not joints:
        raise SystemExit(f"{_NO_CHAIN}: no joint of it moves")
    return foot, joints


def _only_joint(moving: Moving) -> tuple[ElementTree.Element, Points]:
    """Return the joint that moves what follows a link, and the pose of its frame."""
    for joint, _ in moving:
        name, kind = joint.get("name"), joint.get("type")
        if len(moving) > 1 or kind not in _MOVING:
            found = ", ".join(f"`{one.get('name')}` ({one.get('type')})" for one, _ in moving)
            raise SystemExit(
                f"{_NO_CHAIN}: `{link_of(joint, 'parent')}` has the joints {found}; remove what branches "
                "off, as fingers, or make its joint `fixed`: its shapes and mass are then the link's"
            )
        if joint.find("mimic") is not None:
            raise SystemExit(f"the joint `{name}` mimics another one; AEROS moves each joint by itself")
    return moving[0]


def _range_of(joint: ElementTree.Element) -> tuple[float, float]:
    """Read the lowest and the highest position of a joint, rad or m; a turn of -pi to pi without limits."""
    limit, name, kind = joint.find("limit"), joint.get("name"), joint.get("type")
    if kind == "prismatic" and limit is None:
        raise SystemExit(f"the prismatic joint `{name}` has no `<limit>` in the URDF; add one, in m")
    if kind == "continuous" or limit is None:
        return -pi, pi
    # URDF has 0 for a limit that is left out; of an angle nobody means it.
    most = 0.0 if kind == "prismatic" else pi
    lowest, highest = number_of(limit, "lower", str(-most)), number_of(limit, "upper", str(most))
    if not lowest < highest:
        raise SystemExit(
            f"the limits of the joint `{name}` in the URDF are {lowest:g} and {highest:g}; write `lower` and "
            "`upper`, the lower one first"
        )
    return lowest, highest


def denavit_hartenberg(joints: list[Joint]) -> tuple[Rows, list[Points]]:
    """Convert a chain to modified Denavit-Hartenberg parameters with the same zero posture.

    The x of a frame has to be normal to the next axis and to meet it. If it does not in the zero posture, the
    frame is turned about its own axis, which is the `zero` of its row. Of a prismatic joint only the
    direction of its axis matters: it is laid through the origin of the frame before it.

    Args:
        joints: the joints.

    Returns:
        The rows, and the pose of each URDF frame in the frame of the row (4, 4).

    Raises:
        SystemExit: the first axis is not normal to the base's x, or does not meet the base's x or z.
    """
    rows: list[tuple[float, float, float, float]] = []
    urdf, row_frame = np.eye(4), np.eye(4)
    for joint in joints:
        urdf = urdf @ joint.place
        point = row_frame[:3, 3] if joint.slides else urdf[:3, 3]
        turn, length, twist, offset, shift = _next_row(row_frame, urdf[:3, :3] @ joint.axis, point)
        if not rows and (abs(turn) > _TOLERANCE or abs(shift) > _TOLERANCE):
            raise SystemExit(
                "the axis of joint 1 is not normal to the base's x, or passes beside it; turn or move the "
                "frame of the base link"
            )
        if rows:
            before = rows[-1]
            rows[-1] = (before[0], before[1], before[2] + shift, before[3] + turn)
        rows.append((length, twist, offset, 0.0))
        row_frame = _frames(tuple(rows))[-1]
    urdf, offsets = np.eye(4), []
    for joint, frame in zip(joints, _frames(tuple(rows)), strict=True):
        urdf = urdf @ joint.place
        offsets.append(np.linalg.inv(frame) @ urdf)
    return tuple(_rounded(row, joint.slides) for row, joint in zip(rows, joints, strict=True)), offsets


def _next_row(frame: Points, axis: Points, point: Points) -> tuple[float, float, float, float, float]:
    """Lead from a frame to the next axis.

    Args:
        frame: pose of the frame (4, 4), m; it may be turned about its z and moved along it.
        axis: direction of the next axis (3,).
        point: a point of the next axis (3,), m.

    Returns:
        The turn about the frame's z, rad; a (m), alpha (rad) and d (m) from the turned frame; and the way
        along the frame's z, m.
    """
    ux, uy, uz = (frame[:3, :3].T @ axis).tolist()
    x, y, z = (frame[:3, :3].T @ (point - frame[:3, 3])).tolist()
    is_parallel = hypot(ux, uy) < _PARALLEL
    # The direction of the common normal, or of the way between parallel axes.
    nx, ny = (x, y) if is_parallel else (-uy, ux)
    turn = atan2(ny, nx) if hypot(nx, ny) > _TOLERANCE else 0.0
    # Of both directions the nearer one; near to 90 degrees the sign is of rounding.
    if abs(turn) > pi / 2.0 + _TOLERANCE:
        turn -= copysign(pi, turn)
    if abs(turn) < _TOLERANCE:
        turn = 0.0
    c, s = cos(turn), sin(turn)
    x, y, uy = c * x + s * y, c * y - s * x, c * uy - s * ux
    if is_parallel:
        return (turn, x, 0.0 if uz > 0.0 else pi, z if uz > 0.0 else -z, 0.0)
    twist = atan2(-uy, uz)
    offset = -y / sin(twist)
    return (turn, x, twist, offset, z - cos(twist) * offset)


def _rounded(row: Row, slides: bool) -> Row:
    length, twist, offset, zero = row[0], row[1], row[2], zero_angle(row)
    a, d = round(length, 9) + 0.0, round(offset, 9) + 0.0
    if slides:
        return (a, twist, d, zero, PRISMATIC)
    return (a, twist, d, zero) if zero else (a, twist, d)


def _frames(rows: Rows) -> list[Points]:
    """Compute the pose of each row's frame in the zero posture (4, 4)."""
    frames = []
    for frame in frames_of(map(mounting_of, rows), [0.0] * len(rows))[1:]:
        pose: Points = np.eye(4)
        pose[:3, :] = np.array([frame.x, frame.y, frame.z, frame.origin]).T
        frames.append(pose)
    return frames


def fit_capsule(points: Points) -> tuple[Points, Points, float]:
    """Fit a capsule of small volume that holds all points.

    Args:
        points: (n, 3), m.

    Returns:
        Both ends of its axis (3,), and its radius, m; rounded, and holding the points as rounded.
    """
    middle = points.mean(axis=0)
    _, _, ways = np.linalg.svd(points - middle, full_matrices=False)

    def radius_of(ends: Points) -> float:
        a, b = ends[:3], ends[3:]
        along = b - a
        share = np.clip((points - a) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        return float(np.linalg.norm(points - a - share[:, None] * along, axis=1).max())

    def volume(ends: Points) -> float:
        radius = radius_of(ends)
        return pi * radius**2 * (float(np.linalg.norm(ends[3:] - ends[:3])) + 4.0 / 3.0 * radius)

    best: Points | None = None
    for way in ways:
        reach = 0.6 * np.abs((points - middle) @ way).max() * way
        for share in (0.3, 1.0):
            start = np.concatenate((middle - share * reach, middle + share * reach))
            found = minimize(volume, start, method="Nelder-Mead", options={"maxiter": 4000, "xatol": 1e-5})
            if best is None or volume(found.x) < volume(best):
                best = found.x
    if best is None:
        raise SystemExit("a mesh has no vertices")
    ends = best.round(3) + 0.0
    return ends[:3], ends[3:], float(np.ceil((radius_of(ends) + _MARGIN) * 1e4) / 1e4)


def ready_posture(
    rows: Rows,
    reach: float,
    turn: float,
    ends: tuple[Points, Points],
    meeting: Callable[[Points], tuple[str, str] | None],
) -> tuple[Points | None, Counter[tuple[str, str]]]:
    """Find a posture whose tool points down with its fingers closing along y of the base.

    Args:
        rows: modified Denavit-Hartenberg parameters of the chain.
        reach: distance of the tool centre point from the last joint's frame, m.
        turn: angle by which the hand is mounted turned, rad.
        ends: lowest and highest joint positions, each (joints,), rad or m.
        meeting: returns two links that come too near each other in a posture, or None.

    Returns:
        Of the postures found in which no links meet, the one from which straight lines lead to the most
        places, and of several the one farthest from the limits (joints,), rad or m; None if there is none.
        And how often which links met in the others.
    """
    mountings, (lowest, highest) = [mounting_of(row) for row in rows], ends
    tool, (c, s) = (0.0, 0.0, reach), (cos(turn), sin(turn))
    random = np.random.default_rng(0)
    margin = np.minimum(_ROOM, (highest - lowest) / 4.0)
    inner, outer = lowest + margin, highest - margin
    met: Counter[tuple[str, str]] = Counter()

    def miss(q: Points, place: Points) -> Points:
        frame = frames_of(mountings, q.tolist())[-1]
        x, y = np.array(frame.x), np.array(frame.y)
        axes = (c * x + s * y - (1.0, 0.0, 0.0), np.array(frame.z) - (0.0, 0.0, -1.0))
        return np.concatenate((np.array(frame.to_base(tool)) - place, *axes))

    def room(q: Points) -> float:
        return float(np.minimum(q - lowest, highest - q).min())

    for x, z in _READY_PLACES:
        place = np.array([x, 0.0, z])
        found = [
            least_squares(
                miss, random.uniform(inner, outer), bounds=(inner, outer), args=(place,), xtol=1e-12
            )
            for _ in range(_TRIES)
        ]
        solved = [one.x for one in found if float(np.abs(one.fun).max()) < _TOLERANCE]
        best: tuple[int, Points] | None = None
        for q in sorted(solved, key=room, reverse=True):
            links = meeting(q)
            if links is not None:
                met[links] += 1
                continue
            count = count_lines(rows, reach, turn, ends, q, lambda one: meeting(one) is None)
            if best is None or count > best[0]:
                best = count, q
        if best is not None:
            return best[1], met
    return None, met


def _arguments() -> Namespace:
    parser = ArgumentParser(prog="python -m tools.fit_robot", description=__doc__.split(":")[0] + ".")
    parser.add_argument("urdf", type=Path, help="the URDF of the arm")
    parser.add_argument("name", help="id of the robot; the hulls are written to NAME_hulls.json")
    parser.add_argument(
        "flange",
        type=float,
        help="distance of the hand from the last joint's frame, m; below 0 if it is on the side to which the "
        "axis does not point",
    )
    parser.add_argument("turn", type=float, help="turn of the hand about the last joint's axis, rad")
    parser.add_argument(
        "adapter", type=float, nargs="?", default=0.0, help="length of a cylinder that holds the hand, m"
    )
    parser.add_argument("--gripper", type=Path, help="the URDF of a gripper with two parallel fingers")
    asked = parser.parse_args()
    if Path(asked.name).name != asked.name:
        parser.error(f"NAME is `{asked.name}`; give a name without a folder")
    if not 0.0 < abs(asked.flange) <= _FARTHEST_FLANGE:
        parser.error(f"FLANGE is {asked.flange:g}; give the distance in m, other than 0 and 1 at most")
    if not (isfinite(asked.turn) and abs(asked.turn) <= 2.0 * pi):
        parser.error(f"TURN is {asked.turn:g}; give an angle in rad, within a turn")
    if not 0.0 <= asked.adapter <= abs(asked.flange):
        parser.error(f"ADAPTER is {asked.adapter:g}; give a length in m, no more than that of FLANGE")
    return asked


def main() -> None:
    """Print and write the parts of the robot file."""
    asked = _arguments()
    name, flange, turn = asked.name, abs(asked.flange), asked.turn
    gripper = None if asked.gripper is None else read_gripper_urdf(asked.gripper)
    tool = reference_robot().hand.tool if gripper is None else gripper.tool
    root = read_urdf(asked.urdf)
    tree = read_tree(root)
    foot, joints = read_chain(root)
    for link, _ in (*foot, *(one for joint in joints for one in joint.part)):
        if link not in tree.links:
            raise SystemExit(f"a joint of the URDF names the link `{link}`, which is not there")
    if asked.flange < 0.0:
        joints[-1] = reversed_joint(joints[-1])
        print(f"# The positions of joint {len(joints)} have the opposite sign of those in the URDF.")
    rows, offsets = denavit_hartenberg(joints)
    ends = tuple(np.array([getattr(one, end) for one in joints]) for end in ("lowest", "highest"))
    _print_chain(rows)
    parts = [
        [(link, moved @ place) for link, place in joint.part]
        for joint, moved in zip(joints, offsets, strict=True)
    ]
    _print_fixed([foot, *parts])
    print("links:")
    for part in parts:
        mass = mass_of_parts(part, tree, f"the link `{part[0][0]}`")
        print(f"    - mass: {mass.mass!r}\n      centre: {mass.centre}\n      inertia: {mass.inertia}")
    shapes = _shapes(foot, parts, tree, asked, gripper)
    if gripper is not None:
        print("hand:", "  model: two_fingers", *gripper.lines, sep="\n")
    print("capsules:")
    for link, (number, points) in shapes.items():
        a, b, radius = fit_capsule(points)
        print(f"  - {{link: {link}, joint: {number}, a: {a.tolist()}, b: {b.tolist()}, radius: {radius!r}}}")
    hulls = tuple(fit_hull(link, number, points) for link, (number, points) in shapes.items())
    exempt = write_hulls(Path(f"{name}_hulls.json"), rows, hulls, ends[0], ends[1])
    _print_postures(RobotBody(rows, (0.0,) * 3, (), hulls, exempt), flange + tool, turn, (ends[0], ends[1]))


def reversed_joint(joint: Joint) -> Joint:
    """Turn the axis of a joint round.

    Args:
        joint: the joint.

    Returns:
        A joint with the same motions, at positions of the opposite sign.
    """
    return joint._replace(axis=-joint.axis, lowest=-joint.highest, highest=-joint.lowest)


def _print_chain(rows: Rows) -> None:
    print("chain:")
    for row in rows:
        zero = f", zero: {zero_angle(row)!r}" if zero_angle(row) else ""
        kind = ", joint: prismatic" if is_prismatic(row) else ""
        print(f"  - {{length: {row[0]!r}, twist: {row[1]!r}, offset: {row[2]!r}{zero}{kind}}}")


def _print_fixed(parts: Sequence[Parts]) -> None:
    """Print which links became parts of others."""
    for number, (first, *others) in enumerate(parts):
        if others:
            link = f"link{number}" if number else "foot"
            print(f"# {link} is {', '.join(name for name, _ in (first, *others))}")


def _shapes(
    foot: Parts, parts: Sequence[Parts], tree: UrdfTree, asked: Namespace, gripper: GripperParts | None
) -> dict[str, tuple[int, Points]]:
    """Return of each link the number of joints that move it, and points whose hull holds it (n, 3), m."""
    flange, turn, mount = abs(asked.flange), asked.turn, reference_robot().hand
    shapes = {
        f"link{number}" if number else "foot": (number, np.concatenate(shapes_of(part, tree, asked.urdf)))
        for number, part in enumerate([foot, *parts])
    }
    last = f"link{len(parts)}"
    points = shapes[last][1]
    if asked.adapter:
        points = np.concatenate((points, _cylinder(flange - asked.adapter, flange)))
    shapes[last] = (len(parts), points)
    for part in ("hand", "fingers"):
        if gripper is None:
            points = _mounted(hand_vertices(part), flange - mount.flange, turn - mount.turn)
        else:
            points = _mounted(gripper.palm if part == "hand" else gripper.fingers, flange, turn)
        shapes[part] = (len(parts), points)
    return shapes


def _print_postures(body: RobotBody, reach: float, turn: float, ends: tuple[Points, Points]) -> None:
    """Print `ready`, `lean` and `search`, or which links meet wherever the tool points down."""
    pairs, still = hull_pairs(body), [0.0] * len(body.dh_rows)

    def meeting(q: Points) -> tuple[str, str] | None:
        posture = PostureRange(body, q.tolist(), still, still)
        near = (pair for pair in pairs if posture.find_gap(pair, _CLEARANCE) is not None)
        return next(((pair.inner.link, pair.outer.link) for pair in near), None)

    ready, met = ready_posture(body.dh_rows, reach, turn, ends, meeting)
    if ready is None:
        print("ready: # none was found: try another flange or turn")
        for (inner, outer), count in met.most_common(3):
            apart = 1e3 * _CLEARANCE
            print(f"# `{inner}` and `{outer}` come nearer than {apart:g} mm in {count} postures")
        if met:
            print(
                "# If FLANGE has the wrong sign, the hand is inside the arm. A longer adapter brings it away."
            )
        return
    print(f"ready: {ready.round(9).tolist()}")
    lean, search = search_postures(body.dh_rows, reach, turn, ends, ready.round(9))
    print(f"lean: {lean}", "search:", *(f"  - {row}" for row in search), sep="\n")


def _cylinder(low: float, high: float) -> Points:
    """Return points whose hull holds an adapter between two heights along the last joint's axis, m."""
    angles = np.linspace(0.0, 2.0 * pi, 16, endpoint=False)
    radius = _ADAPTER_RADIUS / cos(pi / 16)
    ring = radius * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return np.vstack([np.column_stack((ring, np.full(16, height))) for height in (low, high)])


def _mounted(points: Points, along: float, turn: float) -> Points:
    """Move points along z, m, and turn them about it, rad."""
    c, s = cos(turn), sin(turn)
    x, y, z = points.T
    return np.stack((c * x - s * y, s * x + c * y, z + along), axis=1)


if __name__ == "__main__":
    main()

"""Make the parts of a robot file that come from a URDF: chain, masses, capsules and hulls.

    .venv/bin/python -m tools.fit_robot URDF NAME FLANGE TURN [ADAPTER]

FLANGE is the distance of the hand from the last joint's frame along its axis, m; TURN the angle by which it
is mounted turned about that axis, rad; ADAPTER the length of what holds it, m: a cylinder of 40 mm radius
below the hand, which the last link is given. It prints `chain`, `links` and `capsules` of the robot file,
and writes `NAME_hulls.json` into the current folder.

The URDF has one chain of revolute joints without branches. Modified Denavit-Hartenberg parameters with the
zero posture of the URDF need every axis of that posture to be normal to the base's x; another URDF is
refused: turn its base link.
"""

from __future__ import annotations

import struct
import sys
from math import atan2, cos, pi, sin
from pathlib import Path
from typing import Any, Final, NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.optimize import minimize

from aeros.runtime.ports import Hull
from aeros.sim.robot.robot_file import reference_robot
from tools.fit_link_hulls import Points, Rows, fit_hull, write_hulls
from tools.fit_link_hulls import mesh_vertices as hand_vertices

_TOLERANCE: Final = 1e-6

_ADAPTER_RADIUS: Final = 0.04
"""Radius of what holds the hand, m."""

_MARGIN: Final = 0.0005
"""Room of a capsule around its link, m: its numbers are rounded to 0.1 mm."""


class Joint(NamedTuple):
    """A joint of a URDF.

    Attributes:
        child: name of the link that it moves.
        place: pose of its frame in the frame before it (4, 4), m.
        axis: its axis in its frame (3,).
        lowest: lowest position, rad.
        highest: highest position, rad.
    """

    child: str
    place: Points
    axis: Points
    lowest: float
    highest: float


def read_chain(root: ElementTree.Element) -> tuple[str, list[Joint]]:
    """Read the chain of a URDF.

    Args:
        root: the element `robot`.

    Returns:
        The name of the base link, and the revolute joints from there outwards.

    Raises:
        SystemExit: a link has several revolute joints, or the chain does not begin at one link.
    """
    revolute = [one for one in root.iter("joint") if one.get("type") in ("revolute", "continuous")]
    by_parent = {_link_of(one, "parent"): one for one in revolute}
    children = {_link_of(one, "child") for one in revolute}
    bases = [parent for parent in by_parent if parent not in children]
    if len(by_parent) != len(revolute) or len(bases) != 1:
        raise SystemExit("the URDF is not one chain of revolute joints; remove what branches off")
    joints, link = [], bases[0]
    while link in by_parent:
        one = by_parent[link]
        axis, limit = one.find("axis"), one.find("limit")
        link = _link_of(one, "child")
        joints.append(
            Joint(
                link,
                _pose_of(one.find("origin")),
                np.array([1.0, 0.0, 0.0] if axis is None else _floats(axis.get("xyz", ""))),
                -pi if limit is None else float(limit.get("lower", -pi)),
                pi if limit is None else float(limit.get("upper", pi)),
            )
        )
    return bases[0], joints


def denavit_hartenberg(joints: list[Joint]) -> tuple[Rows, list[Points]]:
    """Convert a chain to modified Denavit-Hartenberg parameters with the same zero posture.

    Args:
        joints: the joints.

    Returns:
        The rows, and the pose of each URDF frame in the frame of the row (4, 4).

    Raises:
        SystemExit: an axis is not normal to the base's x, or two parallel axes are apart along their normal.
    """
    rows: list[tuple[float, float, float]] = []
    offsets: list[Points] = []
    urdf, row_frame = np.eye(4), np.eye(4)
    frames: list[Points] = []
    for number, joint in enumerate(joints, 1):
        urdf = urdf @ joint.place
        axis = row_frame[:3, :3].T @ (urdf[:3, :3] @ joint.axis)
        if abs(axis[0]) > _TOLERANCE:
            raise SystemExit(
                f"the axis of joint {number} is not normal to the base's x at zero; turn the base link"
            )
        twist = atan2(-axis[1], axis[2])
        x, y, z = (row_frame[:3, :3].T @ (urdf[:3, 3] - row_frame[:3, 3])).tolist()
        if abs(sin(twist)) > _TOLERANCE:
            offset, shift = -y / sin(twist), z - cos(twist) * (-y / sin(twist))
        elif abs(y) < _TOLERANCE:
            offset, shift = z * cos(twist), 0.0
        else:
            raise SystemExit(
                f"joint {number} is parallel to the joint before, and not along its x; turn the base link"
            )
        if rows and abs(shift) > _TOLERANCE:
            length, before, along = rows[-1]
            rows[-1] = (length, before, along + shift)
        elif abs(shift) > _TOLERANCE:
            raise SystemExit("the first joint does not turn about the base's z; turn the base link")
        rows.append((x, twist, offset))
        frames = _frames(tuple(rows))
        row_frame = frames[-1]
    urdf = np.eye(4)
    for joint, frame in zip(joints, frames, strict=True):
        urdf = urdf @ joint.place
        offsets.append(np.linalg.inv(frame) @ urdf)
    rounded = tuple((round(a, 9) + 0.0, alpha, round(d, 9) + 0.0) for a, alpha, d in rows)
    return rounded, offsets


def _frames(rows: Rows) -> list[Points]:
    frames, frame = [], np.eye(4)
    for length, twist, offset in rows:
        c, s = cos(twist), sin(twist)
        step = np.array([[1.0, 0, 0, length], [0, c, -s, -s * offset], [0, s, c, c * offset], [0, 0, 0, 1.0]])
        frame = frame @ step
        frames.append(frame)
    return frames


def link_vertices(link: ElementTree.Element, folder: Path) -> Points:
    """Read the vertices of a link's meshes for collisions and for pictures.

    Args:
        link: the element `link`.
        folder: folder of the URDF, from which the meshes' paths lead.

    Returns:
        The vertices in the link's frame (n, 3), m.

    Raises:
        SystemExit: the link has no mesh.
    """
    found = []
    for shape in (*link.findall("collision"), *link.findall("visual")):
        mesh = shape.find("geometry/mesh")
        if mesh is None:
            continue
        points = read_mesh(folder / mesh.get("filename", "").removeprefix("package://"))
        scale = np.array(_floats(mesh.get("scale", "1 1 1")))
        found.append(_transformed(_pose_of(shape.find("origin")), points * scale))
    if not found:
        raise SystemExit(f"the link `{link.get('name')}` has no mesh")
    return np.concatenate(found)


def read_mesh(path: Path) -> Points:
    """Read the vertices of an OBJ or STL file.

    Args:
        path: the file.

    Returns:
        The vertices (n, 3).
    """
    data = path.read_bytes()
    if path.suffix.lower() == ".obj":
        lines = data.decode().splitlines()
        return np.array([[float(x) for x in line.split()[1:4]] for line in lines if line.startswith("v ")])
    if data[:5] == b"solid" and b"vertex" in data[:1000]:
        words = [
            line.split()[1:4] for line in data.decode().splitlines() if line.strip().startswith("vertex")
        ]
        return np.array([[float(x) for x in word] for word in words])
    (count,) = struct.unpack_from("<I", data, 80)
    triangles = np.frombuffer(data, dtype=np.dtype([("f", "<f4", 12), ("a", "<u2")]), count=count, offset=84)
    return np.asarray(triangles["f"][:, 3:].reshape(-1, 3), dtype=np.float64)


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
    ends = best.round(3)
    return ends[:3], ends[3:], float(np.ceil((radius_of(ends) + _MARGIN) * 1e4) / 1e4)


def main() -> None:
    """Print and write the parts of the robot file."""
    path, name, flange, turn = Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
    adapter = float(sys.argv[5]) if len(sys.argv) > 5 else 0.0
    root = ElementTree.parse(path).getroot()  # noqa: S314  a file of the user's own
    base, joints = read_chain(root)
    rows, offsets = denavit_hartenberg(joints)
    print("chain:")
    for length, twist, offset in rows:
        print(f"  - {{length: {length!r}, twist: {twist!r}, offset: {offset!r}}}")
    links = {one.get("name", ""): one for one in root.findall("link")}
    print("  links:")
    for joint, moved in zip(joints, offsets, strict=True):
        _print_mass(links[joint.child], moved)
    shapes = {"foot": (0, link_vertices(links[base], path.parent))}
    for number, (joint, moved) in enumerate(zip(joints, offsets, strict=True), 1):
        shapes[f"link{number}"] = (
            number,
            _transformed(moved, link_vertices(links[joint.child], path.parent)),
        )
    last = f"link{len(rows)}"
    shapes[last] = (len(rows), np.concatenate((shapes[last][1], _cylinder(flange - adapter, flange))))
    for part in ("hand", "fingers"):
        shapes[part] = (len(rows), _mounted(hand_vertices(part), flange, turn))
    print("capsules:")
    for link, (number, points) in shapes.items():
        a, b, radius = fit_capsule(points)
        print(f"  - {{link: {link}, joint: {number}, a: {a.tolist()}, b: {b.tolist()}, radius: {radius!r}}}")
    hulls: tuple[Hull, ...] = tuple(
        fit_hull(link, number, points) for link, (number, points) in shapes.items()
    )
    lowest, highest = (np.array([getattr(one, end) for one in joints]) for end in ("lowest", "highest"))
    write_hulls(Path(f"{name}_hulls.json"), rows, hulls, lowest, highest)


def _cylinder(low: float, high: float) -> Points:
    """Return points whose hull holds an adapter between two heights along the last joint's axis, m."""
    angles = np.linspace(0.0, 2.0 * pi, 16, endpoint=False)
    radius = _ADAPTER_RADIUS / cos(pi / 16)
    ring = radius * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return np.vstack([np.column_stack((ring, np.full(16, height))) for height in (low, high)])


def _mounted(points: Points, flange: float, turn: float) -> Points:
    """Move the hand of the reference robot to another flange and angle."""
    mount = reference_robot().hand
    c, s = cos(turn - mount.turn), sin(turn - mount.turn)
    x, y, z = points.T
    return np.stack((c * x - s * y, s * x + c * y, z - mount.flange + flange), axis=1)


def _print_mass(link: ElementTree.Element, moved: Points) -> None:
    inertial = link.find("inertial")
    if inertial is None:
        raise SystemExit(f"the link `{link.get('name')}` has no mass")
    place, mass, inertia = (
        moved @ _pose_of(inertial.find("origin")),
        inertial.find("mass"),
        inertial.find("inertia"),
    )
    if mass is None or inertia is None:
        raise SystemExit(f"the link `{link.get('name')}` has no mass or inertia")
    one = {key: float(value) for key, value in inertia.items()}
    tensor = np.array(
        [
            [one["ixx"], one["ixy"], one["ixz"]],
            [one["ixy"], one["iyy"], one["iyz"]],
            [one["ixz"], one["iyz"], one["izz"]],
        ]
    )
    turned = place[:3, :3] @ tensor @ place[:3, :3].T
    parts = [turned[0, 0], turned[1, 1], turned[2, 2], turned[0, 1], turned[0, 2], turned[1, 2]]
    print(f"    - mass: {float(mass.get('value', 0))!r}")
    print(f"      centre: {[round(float(x), 6) + 0.0 for x in place[:3, 3]]}")
    print(f"      inertia: {[round(float(x), 6) + 0.0 for x in parts]}")


def _transformed(pose: Points, points: Points) -> Points:
    moved: Points = points @ pose[:3, :3].T + pose[:3, 3]
    return moved


def _pose_of(origin: Any) -> Points:
    pose: Points = np.eye(4)
    if origin is None:
        return pose
    roll, pitch, yaw = _floats(origin.get("rpy", "0 0 0"))
    cr, sr, cp, sp, cy, sy = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = _floats(origin.get("xyz", "0 0 0"))
    return pose


def _floats(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def _link_of(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


if __name__ == "__main__":
    main()

"""Read the shapes of a URDF's links: points whose convex hull holds each link.

Meshes are OBJ or STL files; boxes, cylinders and spheres are points that enclose them. A mesh for pictures in
another format is left out if the link has a shape for collisions.
"""

from __future__ import annotations

import struct
from itertools import product
from math import cos, isfinite, pi, sin
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np

from tools.fit_link_hulls import Points

_SIDES: Final = 16
"""Corners of the polygon that encloses a circle."""

_PACKAGE: Final = "package://"


def read_urdf(path: Path) -> ElementTree.Element:
    """Read a URDF.

    Args:
        path: the file.

    Returns:
        Its element `robot`.

    Raises:
        SystemExit: the file cannot be read, or is not XML.
    """
    try:
        return ElementTree.parse(path).getroot()  # noqa: S314  a file of the user's own
    except (OSError, ElementTree.ParseError) as failure:
        raise SystemExit(f"{path}: {failure}") from failure


def link_vertices(link: ElementTree.Element, urdf: Path) -> Points:
    """Read points whose hull holds a link's shapes for collisions and for pictures.

    Args:
        link: the element `link`.
        urdf: path of the URDF.

    Returns:
        The points in the link's frame (n, 3), m.

    Raises:
        SystemExit: the link has no shape that can be read, or a mesh is missing.
    """
    return np.concatenate(link_shapes(link, urdf))


def link_shapes(link: ElementTree.Element, urdf: Path) -> list[Points]:
    """Read each shape of a link, for collisions and for pictures.

    Args:
        link: the element `link`.
        urdf: path of the URDF.

    Returns:
        Of each shape, points in the link's frame whose hull holds it (n, 3), m.

    Raises:
        SystemExit: the link has no shape that can be read, or a mesh is missing.
    """
    found: list[Points] = []
    left_out: list[str] = []
    for shape in (*link.findall("collision"), *link.findall("visual")):
        mesh = shape.find("geometry/mesh")
        name = "" if mesh is None else mesh.get("filename", "")
        if name and Path(name).suffix.lower() not in (".obj", ".stl"):
            if shape.tag == "collision" or not found:
                left_out.append(name)
            continue
        found.append(transform(pose_of(shape.find("origin")), _points_of(shape, urdf)))
    if left_out:
        raise SystemExit(
            f"`{left_out[0]}` is no OBJ or STL file: convert it, and name the new file in the URDF"
        )
    if not found:
        raise SystemExit(f"the link `{link.get('name')}` has no shape; give it a mesh, in OBJ or STL")
    return found


def find_mesh(name: str, urdf: Path) -> Path:
    """Find the file of a mesh.

    A path of a package, `package://NAME/PATH`, leads from a folder above the URDF: from the one called NAME,
    or from one that holds NAME, or from one that holds PATH.

    Args:
        name: the mesh's `filename` in the URDF.
        urdf: path of the URDF.

    Returns:
        Path of the file.

    Raises:
        SystemExit: there is no such file.
    """
    bare = name.removeprefix(_PACKAGE).removeprefix("file://")
    folders = [*urdf.resolve().parents] if name.startswith(_PACKAGE) else [urdf.parent]
    paths = [bare, *([bare.partition("/")[2]] if name.startswith(_PACKAGE) else [])]
    for folder, path in product(folders, paths):
        if (folder / path).is_file():
            return folder / path
    raise SystemExit(f"there is no file `{bare}` in {urdf.parent} or, for a package, in a folder above")


def read_mesh(path: Path) -> Points:
    """Read the vertices of an OBJ or STL file.

    Args:
        path: the file.

    Returns:
        The vertices (n, 3).

    Raises:
        SystemExit: the file is none of these, or has no vertices.
    """
    try:
        points = _vertices(path)
    except (OSError, ValueError, struct.error) as failure:
        raise SystemExit(f"{path}: not an OBJ or STL file: {failure}") from failure
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise SystemExit(f"{path}: no vertices of three numbers; export the mesh again")
    return points


def _vertices(path: Path) -> Points:
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


def _points_of(shape: ElementTree.Element, urdf: Path) -> Points:
    geometry = shape.find("geometry")
    for one in () if geometry is None else geometry:
        match one.tag:
            case "mesh":
                scale = np.array(numbers_of(one, "scale", "1 1 1"))
                points: Points = read_mesh(find_mesh(one.get("filename", ""), urdf)) * scale
                return points
            case "box":
                halves = [(-edge / 2.0, edge / 2.0) for edge in numbers_of(one, "size")]
                return np.array([*product(*halves)])
            case "cylinder":
                radius, length = number_of(one, "radius"), number_of(one, "length")
                return np.array([(x, y, z) for x, y in _ring(radius) for z in (-length / 2.0, length / 2.0)])
            case "sphere":
                radius = number_of(one, "radius")
                return np.array([*product((-radius, radius), repeat=3)])
    raise SystemExit(f"a `{shape.tag}` has no geometry that is known: mesh, box, cylinder or sphere")


def _ring(radius: float) -> list[tuple[float, float]]:
    outer = radius / cos(pi / _SIDES)
    angles = [2.0 * pi * number / _SIDES for number in range(_SIDES)]
    return [(outer * cos(angle), outer * sin(angle)) for angle in angles]


def transform(pose: Points, points: Points) -> Points:
    """Express points in another frame.

    Args:
        pose: pose of the points' frame in the other one (4, 4), m.
        points: (n, 3), m.

    Returns:
        The points in the other frame (n, 3), m.
    """
    moved: Points = points @ pose[:3, :3].T + pose[:3, 3]
    return moved


def pose_of(origin: ElementTree.Element | None) -> Points:
    """Read an element `origin`.

    Args:
        origin: the element; None stands for no displacement.

    Returns:
        The pose (4, 4), m.
    """
    pose: Points = np.eye(4)
    if origin is None:
        return pose
    roll, pitch, yaw = numbers_of(origin, "rpy", "0 0 0")
    cr, sr, cp, sp, cy, sy = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = numbers_of(origin, "xyz", "0 0 0")
    return pose


def axis_of(joint: ElementTree.Element) -> Points:
    """Read the axis of a joint.

    Args:
        joint: the element `joint`.

    Returns:
        Its direction in the joint's frame (3,), of length 1; x if it is left out.

    Raises:
        SystemExit: it has other than three numbers, or no direction.
    """
    element = joint.find("axis")
    axis = np.array([1.0, 0.0, 0.0] if element is None else numbers_of(element, "xyz", "1 0 0"))
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        raise SystemExit(f"the axis of the joint `{joint.get('name')}` has no direction; write `1 0 0`")
    unit: Points = axis / length
    return unit


def numbers_of(element: ElementTree.Element, name: str, default: str = "", count: int = 3) -> list[float]:
    """Read an attribute that has numbers.

    Args:
        element: the element.
        name: name of the attribute.
        default: its text if it is left out.
        count: how many numbers it has.

    Returns:
        The numbers.

    Raises:
        SystemExit: it has other than `count` finite numbers.
    """
    text = element.get(name, default)
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(isfinite, numbers)):
        needed = "a number" if count == 1 else f"{count} numbers"
        raise SystemExit(f"`{name}` of `<{element.tag}>` in the URDF is `{text}`; it needs {needed}")
    return numbers


def number_of(element: ElementTree.Element, name: str, default: str = "") -> float:
    """Read an attribute that has a number.

    Args:
        element: the element.
        name: name of the attribute.
        default: its text if it is left out.

    Returns:
        The number.

    Raises:
        SystemExit: it has none.
    """
    (number,) = numbers_of(element, name, default, 1)
    return number

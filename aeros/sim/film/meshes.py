"""Triangles of a robot's links: of its mesh files, or else of the hulls of its links, rounded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Pose, Vector3
from aeros.sim.pictures.urdf_model import origin_of
from aeros.spec.model.scene import Colour

Array = NDArray[np.float64]


class Mesh(NamedTuple):
    """Triangles of one colour.

    Attributes:
        corners: positions (n, 3), m.
        triangles: numbers of the corners of each triangle (m, 3), counterclockwise from outside.
        colour: red, green and blue in [0, 1].
    """

    corners: Array
    triangles: NDArray[np.int32]
    colour: Colour


class LinkMesh(NamedTuple):
    """A mesh of a link.

    Attributes:
        link: name of the link in its URDF file.
        place: pose of the mesh in the frame of the link.
        mesh: the mesh.
    """

    link: str
    place: Pose
    mesh: Mesh


def data_folder() -> Path | None:
    """Find the data files of PyBullet.

    Returns:
        Their folder; None if they are not installed.
    """
    spec = find_spec("pybullet_data")
    return None if spec is None or spec.origin is None else Path(spec.origin).parent


def stock_urdf_file(path: str) -> Path | None:
    """Find a URDF file in PyBullet's data.

    Args:
        path: its path there.

    Returns:
        The file; None if the data are not installed, or have no such file.
    """
    folder = data_folder()
    if folder is None or not path:
        return None
    file = (folder / path).resolve()
    return file if folder.resolve() in file.parents and file.is_file() else None


def meshes_of_urdf(path: Path) -> Iterator[LinkMesh]:
    """Read the visible meshes of a URDF file.

    Args:
        path: the file; its meshes are OBJ files.

    Yields:
        The meshes.
    """
    root = Xml.fromstring(path.read_bytes())  # noqa: S314  a file of a package that is installed
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            for mesh in visual.findall("geometry/mesh"):
                file = path.parent / mesh.get("filename", "").removeprefix("package://")
                for one in read_obj(file):
                    yield LinkMesh(link.get("name", ""), origin_of(visual), one)


def read_obj(path: Path) -> list[Mesh]:
    """Read an OBJ file, a mesh for each of its materials.

    Args:
        path: the file; its polygons are convex.

    Returns:
        The meshes.
    """
    colours = _colours_of(path.with_suffix(".mtl"))
    corners: list[Vector3] = []
    faces: dict[str, list[tuple[int, int, int]]] = {}
    material = ""
    for line in path.read_text("utf-8", "replace").splitlines():
        if line.startswith(("vn", "vt")):  # normals and places in textures: most of a file
            continue
        word, *rest = line.split() or [""]
        if word == "v":
            corners.append((float(rest[0]), float(rest[1]), float(rest[2])))
        elif word == "usemtl":
            material = rest[0]
        elif word == "f":
            numbers = [_corner_number(one, len(corners)) for one in rest]
            fan = pairwise(numbers[1:])
            faces.setdefault(material, []).extend((numbers[0], a, b) for a, b in fan)
    points = np.array(corners)
    meshes = []
    for name, triangles_of in faces.items():
        used, triangles = np.unique(np.array(triangles_of), return_inverse=True)
        meshes.append(
            Mesh(points[used], triangles.reshape(-1, 3).astype(np.int32), colours.get(name, (0.9, 0.9, 0.9)))
        )
    return meshes


def _corner_number(text: str, count: int) -> int:
    number = int(text.partition("/")[0])
    return number - 1 if number > 0 else count + number


def _colours_of(path: Path) -> dict[str, Colour]:
    colours: dict[str, Colour] = {}
    name = ""
    if not path.is_file():
        return colours
    for line in path.read_text("utf-8", "replace").splitlines():
        word, *rest = line.split() or [""]
        if word == "newmtl":
            name = rest[0]
        elif word == "Kd":
            colours[name] = (float(rest[0]), float(rest[1]), float(rest[2]))
    return colours


def rounded_corners(corners: Sequence[Vector3], radius: float) -> Array:
    """Surround each corner of a hull with a ball, so that its hull is rounded.

    Args:
        corners: corners of the hull, m.
        radius: of the balls, m.

    Returns:
        Points (n, 3) whose convex hull is rounded, m.
    """
    golden = np.pi * (3.0 - 5.0**0.5)
    count = np.arange(40) + 0.5
    z = 1.0 - count / 20.0
    across = np.sqrt(1.0 - z * z)
    ball = np.stack((across * np.cos(golden * count), across * np.sin(golden * count), z), axis=1)
    return (np.array(corners)[:, None, :] + radius * ball[None, :, :]).reshape(-1, 3)

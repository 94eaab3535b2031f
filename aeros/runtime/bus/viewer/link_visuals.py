"""Meshes of links for the robot's description: inside its text, or as files beside the run.

Viewers that read a recording or a live view have no access to files, but read `data:` addresses.  RViz reads
files, and no `data:` addresses.
"""

from __future__ import annotations

from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from struct import pack
from typing import Final
from urllib.parse import quote

from aeros.files import make_folder
from aeros.runtime.bus.robot_description import LinkVisual
from aeros.runtime.bus.viewer.hull_meshes import encode_glb, hull_triangles
from aeros.runtime.ports import ColouredMesh, Hull, LinkModel, Vec3

LINK_MESHES: Final = "link_meshes"
"""Folder of the meshes for peers on ROS 2, in the folder of a run."""

LINK_COLOUR: Final = (0.75, 0.76, 0.8)
"""Red, green and blue of links whose visible surfaces are unknown."""

_STL_HEADER: Final = b"binary STL, m".ljust(80)
_NO_NORMAL: Final = (0.0, 0.0, 0.0)
"""Readers compute the normal of a triangle themselves then."""


def link_model(hull: Hull, models: Mapping[Hull, LinkModel]) -> LinkModel:
    """Return how viewers draw a link.

    Args:
        hull: the link's hull.
        models: visible surfaces of links, by hull.

    Returns:
        The link's surfaces; else those of its hull, none if that is flat.
    """
    known = models.get(hull)
    if known is not None and known.surfaces:
        return known
    triangles = hull_triangles(hull.corners)
    return LinkModel((ColouredMesh(hull.corners, triangles, LINK_COLOUR),) if triangles else (), "")


def embedded_visuals(models: Mapping[Hull, LinkModel]) -> Callable[[Hull], Sequence[LinkVisual]]:
    """Make the function that puts meshes into the description as `data:` addresses of binary glTF.

    Args:
        models: visible surfaces of links, by hull.

    Returns:
        A function from a link's hull to its meshes.
    """

    def visuals(hull: Hull) -> Sequence[LinkVisual]:
        surfaces, origin = link_model(hull, models)
        if not surfaces:
            return ()
        data = b64encode(encode_glb(surfaces)).decode()
        return (LinkVisual(f"data:model/gltf-binary;base64,{data}", None, origin),)

    return visuals


def filed_visuals(folder: Path, models: Mapping[Hull, LinkModel]) -> Callable[[Hull], Sequence[LinkVisual]]:
    """Make the function that writes meshes to files, one for each colour of a link.

    Files have the names of links, in which `/` and the like are written as in URLs, and a number.

    Args:
        folder: folder of the files, which need not exist.
        models: visible surfaces of links, by hull.

    Returns:
        A function from a link's hull to its meshes; to none if they cannot be written.
    """
    written: dict[Hull, Sequence[LinkVisual]] = {}
    counts = Counter[str]()

    def visuals(hull: Hull) -> Sequence[LinkVisual]:
        if hull in written:
            return written[hull]
        surfaces, origin = link_model(hull, models)
        found = []
        try:
            make_folder(folder)
            for number, surface in enumerate(surfaces, counts[hull.link]):
                path = (folder / f"{quote(hull.link, safe='')}-{number}.stl").resolve()
                path.write_bytes(encode_stl(surface))
                found.append(LinkVisual(path.as_uri(), surface.colour, origin))
        except OSError:
            return ()
        counts[hull.link] += len(surfaces)
        written[hull] = found
        return found

    return visuals


def encode_stl(surface: ColouredMesh) -> bytes:
    """Encode a surface as binary STL, which has neither colours nor a direction that is up.

    Args:
        surface: the surface; lengths in m.

    Returns:
        The file.
    """
    corners: Sequence[Vec3] = surface.corners
    data = bytearray(_STL_HEADER + pack("<I", len(surface.triangles)))
    for triangle in surface.triangles:
        places = chain.from_iterable(corners[number] for number in triangle)
        data += pack("<12fH", *_NO_NORMAL, *places, 0)
    return bytes(data)

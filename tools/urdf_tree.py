"""Read the links of a URDF that fixed joints hold together: where they are, their shapes and their mass."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from tools.fit_link_hulls import Points
from tools.urdf_shapes import link_shapes, number_of, pose_of, transform

Parts = Sequence[tuple[str, Points]]
"""Names of links that are fixed to one another, each with its pose (4, 4), m, in the frame of one of them."""

Moving = Sequence[tuple[ElementTree.Element, Points]]
"""Joints that move, each with the pose of its frame (4, 4), m."""

_SHAPES = ("collision", "visual")
"""Elements of a link that have shapes."""


class UrdfTree(NamedTuple):
    """The links and joints of a URDF.

    Attributes:
        links: the elements `link`, by name.
        joints: the elements `joint` on each link, by the link's name.
    """

    links: dict[str, ElementTree.Element]
    joints: dict[str, list[ElementTree.Element]]

    def roots(self) -> list[str]:
        """List the links that no joint holds, those that have joints or are declared.

        Returns:
            Their names, in the order of the file.
        """
        children = {link_of(one, "child") for some in self.joints.values() for one in some}
        return [name for name in {**self.links, **self.joints} if name not in children]


class RigidMass(NamedTuple):
    """Mass of links that are fixed to one another.

    Attributes:
        mass: kg.
        centre: centre of mass, m.
        inertia: xx, yy, zz, xy, xz and yz about the centre, kg m^2.
    """

    mass: float
    centre: list[float]
    inertia: list[float]


def read_tree(root: ElementTree.Element) -> UrdfTree:
    """Sort the links and joints of a URDF.

    Args:
        root: the element `robot`.

    Returns:
        The links and joints.
    """
    joints: dict[str, list[ElementTree.Element]] = {}
    for one in root.findall("joint"):
        joints.setdefault(link_of(one, "parent"), []).append(one)
    return UrdfTree({one.get("name", ""): one for one in root.findall("link")}, joints)


def link_of(joint: ElementTree.Element, end: str) -> str:
    """Read the link at one end of a joint.

    Args:
        joint: the element `joint`.
        end: `parent` or `child`.

    Returns:
        The name of the link; empty if there is none.
    """
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def rigid_part(tree: UrdfTree, name: str, place: Points, seen: set[str]) -> tuple[Parts, Moving]:
    """Find the links that are fixed to one, and the joints on them that move.

    Args:
        tree: the URDF.
        name: the link.
        place: its pose (4, 4), m.
        seen: links that were found before; those found now are added.

    Returns:
        The links, this one first, and the joints.

    Raises:
        SystemExit: a link was found before.
    """
    if name in seen:
        raise SystemExit(f"the joints of the URDF lead back to the link `{name}`; make them a tree")
    seen.add(name)
    part = [(name, place)]
    moving = []
    for joint in tree.joints.get(name, ()):
        there = place @ pose_of(joint.find("origin"))
        if joint.get("type") != "fixed":
            moving.append((joint, there))
            continue
        more, joints = rigid_part(tree, link_of(joint, "child"), there, seen)
        part += more
        moving += joints
    return part, moving


def shapes_of(part: Parts, tree: UrdfTree, path: Path) -> list[Points]:
    """Read the shapes of rigid parts; a link may have none, as a frame at the fingertips.

    Args:
        part: the links.
        tree: the URDF.
        path: its path.

    Returns:
        Of each shape, points whose hull holds it (n, 3), m.

    Raises:
        SystemExit: no link has a shape, or a mesh cannot be read.
    """
    bodies = [one for one in part if any(tree.links[one[0]].find(kind) is not None for kind in _SHAPES)]
    return [
        transform(place, points)
        for name, place in bodies or [part[0]]
        for points in link_shapes(tree.links[name], path)
    ]


def mass_of_parts(part: Parts, tree: UrdfTree, name: str) -> RigidMass:
    """Add up the masses of rigid parts.

    Args:
        part: the links.
        tree: the URDF.
        name: name of the parts for a message.

    Returns:
        Their mass together.

    Raises:
        SystemExit: they have none, or one with a mass has no inertia.
    """
    masses, centres, tensors = [], [], []
    for link, place in part:
        inertial, inertia = (tree.links[link].find(one) for one in ("inertial", "inertial/inertia"))
        mass = link_mass(tree.links[link])
        if inertial is None or mass == 0.0:
            continue
        if inertia is None:
            raise SystemExit(f"the link `{link}` has a mass and no `<inertia>`; add it")
        pose = place @ pose_of(inertial.find("origin"))
        xx, yy, zz, xy, xz, yz = (
            number_of(inertia, key, "0") for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        )
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        masses.append(mass)
        centres.append(pose[:3, 3])
        tensors.append(pose[:3, :3] @ tensor @ pose[:3, :3].T)
    if sum(masses) <= 0.0:
        raise SystemExit(f"{name} has no mass; give its link an `<inertial>`")
    middle = np.array(masses) @ np.array(centres) / sum(masses)
    total = np.zeros((3, 3))
    for mass, centre, tensor in zip(masses, centres, tensors, strict=True):
        away = centre - middle
        total += tensor + mass * (float(away @ away) * np.eye(3) - np.outer(away, away))
    numbers = [total[0, 0], total[1, 1], total[2, 2], total[0, 1], total[0, 2], total[1, 2]]
    return RigidMass(
        float(sum(masses)),
        [round(float(x), 6) + 0.0 for x in middle],
        [round(float(x), 6) + 0.0 for x in numbers],
    )


def link_mass(link: ElementTree.Element) -> float:
    """Read the mass of a link.

    Args:
        link: the element `link`.

    Returns:
        Its mass, kg; 0 if it has none.
    """
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else number_of(mass, "value")

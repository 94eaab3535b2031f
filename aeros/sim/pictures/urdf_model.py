"""Visible or solid parts of a URDF model, and the poses of its links at given joint positions.

Meshes are not drawn. The file has been checked (`aeros.spec.scenes.urdf`). Units: m, rad.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import cos, hypot, sin
from pathlib import Path
from typing import Literal, NamedTuple
from xml.etree import ElementTree as Xml

from aeros.sim.geometry import UPRIGHT, Pose, Quaternion, Vector3, compose
from aeros.sim.pictures.solids import Solid, box, cylinder, sphere
from aeros.sim.pictures.visual_shapes import VisualShape
from aeros.spec.model.scene import GREY, Colour


class _Joint(NamedTuple):
    """A joint: its place in the parent's frame, and how its position moves the child."""

    name: str
    parent: str
    place: Pose
    axis: Vector3
    slides: bool


class UrdfVisuals:
    """Links, joints and parts of a model.

    Args:
        path: the file.
        parts: `visual`, or `collision` for those that other bodies touch.

    Attributes:
        shapes: name of the link and shape, in the link's frame, of each of these parts.
        solids: the same as solids that a ray caster draws.
    """

    def __init__(self, path: str, parts: Literal["visual", "collision"] = "visual") -> None:
        root = Xml.fromstring(Path(path).read_bytes())  # noqa: S314  checked, as above
        colours = {
            material.get("name", ""): _colour(material)
            for material in root.iter("material")
            if material.find("color") is not None
        }
        self.shapes = tuple(
            (link.get("name", ""), shape)
            for link in root.iter("link")
            for visual in link.findall(parts)
            for shape in _shapes(visual, colours)
        )
        self.solids = tuple((link, _solid(shape)) for link, shape in self.shapes)
        self._joint_to = {
            child.get("link", ""): _joint(joint)
            for joint in root.iter("joint")
            for child in joint.findall("child")
        }

    @property
    def sliding_joints(self) -> tuple[str, ...]:
        """Names of the prismatic joints."""
        return tuple(joint.name for joint in self._joint_to.values() if joint.slides)

    def joints_above(self, link: str) -> Iterator[str]:
        """Name the joints that move a link.

        Args:
            link: its name.

        Yields:
            Their names, from the link to the base.
        """
        while (joint := self._joint_to.get(link)) is not None:
            yield joint.name
            link = joint.parent

    def link_pose(self, link: str, positions: Mapping[str, float]) -> Pose:
        """Compute the pose of a link.

        Args:
            link: its name.
            positions: position of each movable joint, rad or m; 0 for those that are absent.

        Returns:
            The pose in the frame of the first link.
        """
        joint = self._joint_to.get(link)
        if joint is None:
            return Pose((0.0, 0.0, 0.0), UPRIGHT)
        position = positions.get(joint.name, 0.0)
        x, y, z = joint.axis
        if joint.slides:
            moved = Pose((position * x, position * y, position * z), UPRIGHT)
        else:
            s = sin(position / 2.0)
            moved = Pose((0.0, 0.0, 0.0), (s * x, s * y, s * z, cos(position / 2.0)))
        return compose(self.link_pose(joint.parent, positions), compose(joint.place, moved))


def _joint(joint: Xml.Element) -> _Joint:
    parent, axis = joint.find("parent"), joint.find("axis")
    x, y, z = (1.0, 0.0, 0.0) if axis is None else vector_of(axis, "xyz")
    length = hypot(x, y, z) or 1.0  # fixed joints may have the axis 0
    return _Joint(
        joint.get("name", ""),
        "" if parent is None else parent.get("link", ""),
        origin_of(joint),
        (x / length, y / length, z / length),
        joint.get("type") == "prismatic",
    )


def _shapes(visual: Xml.Element, colours: Mapping[str, Colour]) -> Iterator[VisualShape]:
    material = visual.find("material")
    colour = GREY
    if material is not None:
        colour = colours.get(material.get("name", ""), GREY)
        colour = colour if material.find("color") is None else _colour(material)
    place = origin_of(visual)
    for shape in visual.findall("geometry/*"):
        radius, length = float(shape.get("radius", 0)), float(shape.get("length", 0))
        match shape.tag:
            case "box":
                yield VisualShape("box", vector_of(shape, "size"), colour, place)
            case "cylinder":
                yield VisualShape("cylinder", (radius, length, 0.0), colour, place)
            case "capsule":
                yield VisualShape("capsule", (radius, length, 0.0), colour, place)
            case "sphere":
                yield VisualShape("sphere", (radius, 0.0, 0.0), colour, place)


def _solid(shape: VisualShape) -> Solid:
    radius, length, _ = shape.size
    match shape.kind:
        case "box":
            solid = box(shape.size, shape.colour)
        case "sphere":
            solid = sphere(radius, shape.colour)
        case _:
            solid = cylinder(radius, length, shape.colour)
    return solid._replace(place=shape.place)


def _colour(material: Xml.Element) -> Colour:
    element = material.find("color")
    if element is None:
        return GREY
    red, green, blue, *_ = (float(part) for part in element.get("rgba", "").split())
    return (red, green, blue)


def origin_of(element: Xml.Element) -> Pose:
    """Read the place of a visual, a collision, an inertial or a joint.

    Args:
        element: the element with an `origin`, or none.

    Returns:
        The pose in the frame of its link; of a joint, in that of the parent.
    """
    origin = element.find("origin")
    if origin is None:
        return Pose((0.0, 0.0, 0.0), UPRIGHT)
    return Pose(vector_of(origin, "xyz"), roll_pitch_yaw(*vector_of(origin, "rpy")))


def vector_of(element: Xml.Element, name: str) -> Vector3:
    """Read three numbers.

    Args:
        element: the element.
        name: of the attribute.

    Returns:
        The numbers; 0 if there is no such attribute.
    """
    x, y, z = (float(part) for part in element.get(name, "0 0 0").split())
    return (x, y, z)


def roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Convert URDF's fixed-axis angles to an orientation.

    Args:
        roll: about x, rad.
        pitch: then about y, rad.
        yaw: then about z, rad.

    Returns:
        The orientation.
    """
    (sr, cr), (sp, cp), (sy, cy) = ((sin(angle / 2.0), cos(angle / 2.0)) for angle in (roll, pitch, yaw))
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )

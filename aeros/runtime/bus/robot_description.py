"""URDF of a robot's chain, for `/robot_description`: the frames of `/tf`, with meshes or balls as links.

URDF turns by roll, pitch, yaw about fixed axes and moves by `xyz`; a modified Denavit-Hartenberg row is
Rx(alpha)·Tx(a)·Rz(angle)·Tz(d). So a joint's origin is `rpy` (alpha, 0, 0) and `xyz`
(a, -sin(alpha)·d, cos(alpha)·d), and its axis is z; it turns about it or slides along it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from re import sub
from typing import Final, NamedTuple
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from aeros.kinematic_chain import is_prismatic, mounting_of, roll_pitch_yaw
from aeros.runtime.bus.transforms import BASE, TOOL, link_frame
from aeros.runtime.ports import Ball, Hull, RobotBody, Vec3

_COLOUR: Final = "0.75 0.76 0.8 1"

_FAR: Final = 100.0
"""Way that no prismatic joint goes, m."""


class LinkVisual(NamedTuple):
    """Mesh of a link.

    Attributes:
        address: URL of the mesh, in the frame of the link, m.
        colour: red, green and blue in [0, 1]; None if the mesh has colours of its own.
        origin: file that the mesh was made of, and its licence; empty for a convex hull.
    """

    address: str
    colour: Vec3 | None
    origin: str = ""


def without_meshes(_: Hull) -> Sequence[LinkVisual]:
    """Return no mesh, so that links are drawn as balls.

    Args:
        _: the link's hull.

    Returns:
        Nothing.
    """
    return ()


def robot_description(
    name: str,
    body: RobotBody,
    joints: Sequence[str],
    visuals: Callable[[Hull], Sequence[LinkVisual]] = without_meshes,
) -> str:
    """Describe a robot as URDF.

    Joints that turn are `continuous`, as a plan does not state their limits. URDF has no joint that slides
    without limits: prismatic joints get wide ones. Links have no masses. Their shapes are meshes, and the
    balls that enclose them are what collides; without meshes the balls are the shapes.

    Args:
        name: Name of the robot.
        body: The chain.
        joints: Names of the joints, one for each row of the chain.
        visuals: Returns the meshes of a link by its hull.

    Returns:
        The XML text; its root link is `base`.
    """
    robot = Element("robot", name=name)
    material = SubElement(robot, "material", name="link")
    SubElement(material, "color", rgba=_COLOUR)
    links = (BASE, *(link_frame(joint) for joint in joints))
    for number, link in enumerate(links):
        element = SubElement(robot, "link", name=link)
        meshes = [mesh for hull in body.hulls if hull.joint == number for mesh in visuals(hull)]
        for place, mesh in enumerate(meshes):
            _add_mesh(element, mesh, f"{link}-{place}")
        for ball in (one for one in body.balls if one.joint == number):
            _add_ball(element, ball, "collision" if meshes else "visual")
    SubElement(robot, "link", name=TOOL)
    for joint, row, parent, child in zip(joints, body.dh_rows, links, links[1:], strict=False):
        kind = "prismatic" if is_prismatic(row) else "continuous"
        element = _joint(robot, joint, kind, (parent, child))
        SubElement(element, "origin", xyz=_vector(mounting_of(row)[:3]), rpy=_vector(roll_pitch_yaw(row)))
        SubElement(element, "axis", xyz="0 0 1")
        if is_prismatic(row):
            SubElement(element, "limit", lower=_number(-_FAR), upper=_number(_FAR), effort="0", velocity="0")
    SubElement(
        _joint(robot, "tool_joint", "fixed", (links[-1], TOOL)), "origin", xyz=_vector(body.tool_offset)
    )
    indent(robot)
    return tostring(robot, "unicode", xml_declaration=True)


def _add_mesh(link: Element, mesh: LinkVisual, name: str) -> None:
    if mesh.origin:
        # XML has neither "--" in a comment nor control characters.
        origin = "".join(one if one.isprintable() else "?" for one in mesh.origin)
        link.append(Comment(f" {sub('-(?=-)', '- ', origin)} "))
    visual = SubElement(link, "visual")
    SubElement(SubElement(visual, "geometry"), "mesh", filename=mesh.address)
    if mesh.colour is not None:
        material = SubElement(visual, "material", name=name)
        SubElement(material, "color", rgba=f"{_vector(mesh.colour)} 1")


def _add_ball(link: Element, ball: Ball, kind: str) -> None:
    shape = SubElement(link, kind)
    SubElement(shape, "origin", xyz=_vector(ball.centre))
    SubElement(SubElement(shape, "geometry"), "sphere", radius=_number(ball.radius))
    if kind == "visual":
        SubElement(shape, "material", name="link")


def _joint(robot: Element, name: str, kind: str, links: tuple[str, str]) -> Element:
    element = SubElement(robot, "joint", name=name, type=kind)
    SubElement(element, "parent", link=links[0])
    SubElement(element, "child", link=links[1])
    return element


def _vector(at: Vec3) -> str:
    return " ".join(_number(one) for one in at)


def _number(value: float) -> str:
    return repr(float(value) + 0.0)

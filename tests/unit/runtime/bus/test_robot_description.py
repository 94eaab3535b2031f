"""URDF describes the frames of `/tf`: its origins lead to where the kinematics puts the tool."""

from __future__ import annotations

import math
from itertools import pairwise
from xml.etree.ElementTree import Element, fromstring

import pytest

from aeros.runtime.bus.robot_description import robot_description
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.ports import Ball, RobotBody

BODY = RobotBody(
    ((0.0, 0.0, 0.333), (0.1, -1.5707963267948966, 0.25), (0.5, 0.7, 0.0)),
    (0.0, 0.0, 0.125),
    (Ball("base", 0, (0.0, 0.0, 0.1), 0.2), Ball("upper", 2, (0.0, 0.05, 0.0), 0.1)),
)
NAMES = ("a", "b", "c")


def described() -> Element:
    return fromstring(robot_description("arm", BODY, NAMES))  # noqa: S314 - our own text


def test_the_origins_are_those_of_the_chain() -> None:
    """At all angles 0: the transforms of URDF, Txyz·Rx(roll), one after the other."""
    robot = described()
    x, y, z, turned = 0.0, 0.0, 0.0, 0.0  # all turns here are about x
    for joint in robot.findall("joint"):
        origin = joint.find("origin")
        assert origin is not None
        a, b, c = (float(one) for one in origin.attrib["xyz"].split())
        cos, sin = math.cos(turned), math.sin(turned)
        x, y, z = x + a, y + cos * b - sin * c, z + sin * b + cos * c
        turned += float(origin.attrib.get("rpy", "0 0 0").split()[0])
    expected = ForwardKinematics(BODY, (0.0, 0.0, 0.0)).frames[-1].to_base(BODY.tool_offset)
    assert (x, y, z) == pytest.approx(expected, abs=1e-12)


def test_links_form_one_tree_from_the_base_to_the_tool() -> None:
    robot = described()
    links = [one.attrib["name"] for one in robot.findall("link")]
    assert links == ["base", "a_link", "b_link", "c_link", "tool"]
    parents = [one.attrib["link"] for one in robot.findall("joint/parent")]
    children = [one.attrib["link"] for one in robot.findall("joint/child")]
    assert list(zip(parents, children, strict=True)) == list(pairwise(links))
    assert [one.attrib["type"] for one in robot.findall("joint")] == ["continuous"] * 3 + ["fixed"]


def test_balls_are_the_shapes_of_their_links() -> None:
    robot = described()
    shapes = {link.attrib["name"]: len(link.findall("visual")) for link in robot.findall("link")}
    assert shapes == {"base": 1, "a_link": 0, "b_link": 1, "c_link": 0, "tool": 0}

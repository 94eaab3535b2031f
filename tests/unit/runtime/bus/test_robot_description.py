"""A robot's description has the frames of the transforms, at the same places."""

from __future__ import annotations

from math import cos, sin
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.kinematic_chain import ORIGIN, child_frame, mounting_of
from aeros.runtime.bus.robot_description import robot_description
from aeros.runtime.ports import Ball, RobotBody

NAMES = ("a", "b")
NUMBERS = st.floats(-1.0, 1.0)
ROWS = st.tuples(NUMBERS, st.floats(-4.0, 4.0), NUMBERS)


def parsed(body: RobotBody, names: tuple[str, ...]) -> ET.Element:
    return ET.fromstring(robot_description(body, names))  # noqa: S314 - made here


def numbers(text: str) -> list[float]:
    return [float(one) for one in text.split()]


@given(st.tuples(ROWS, ROWS))
def test_each_joint_is_where_the_chain_has_it(rows: tuple[tuple[float, float, float], ...]) -> None:
    tree = parsed(RobotBody(rows, (0.0, 0.0, 0.125), ()), NAMES)
    for row, joint in zip(rows, tree.findall("joint"), strict=False):
        origin = joint.find("origin")
        assert origin is not None
        frame = child_frame(ORIGIN, mounting_of(row), 0.0)
        assert numbers(origin.attrib["xyz"]) == pytest.approx(frame.origin, abs=1e-12)
        roll, pitch, yaw = numbers(origin.attrib["rpy"])
        # The y axis after a turn about x.
        assert (0.0, cos(roll), sin(roll)) == pytest.approx(frame.y, abs=1e-12)
        assert (pitch, yaw) == (0.0, 0.0)


def test_links_have_the_names_of_the_frames_and_the_balls_that_enclose_them() -> None:
    balls = (Ball("foot", 0, (0.0, 0.0, 0.1), 0.2), Ball("hand", 2, (0.5, 0.0, 0.0), 0.05))
    body = RobotBody(((0.0, 0.0, 0.25), (0.5, 0.0, 0.0)), (0.0, 0.0, 0.125), balls)
    tree = parsed(body, ("a", 'b"<'))
    assert [one.attrib["name"] for one in tree.findall("link")] == ["base", "a_link", 'b"<_link', "tool"]
    radii = {
        link.attrib["name"]: [float(one.attrib["radius"]) for one in link.iter("sphere")]
        for link in tree.findall("link")
    }
    assert radii == {"base": [0.2], "a_link": [], 'b"<_link': [0.05], "tool": []}
    ends = [
        (one.attrib["type"], one.find("parent").attrib["link"], one.find("child").attrib["link"])  # type: ignore[union-attr]
        for one in tree.findall("joint")
    ]
    assert ends == [
        ("continuous", "base", "a_link"),
        ("continuous", "a_link", 'b"<_link'),
        ("fixed", 'b"<_link', "tool"),
    ]

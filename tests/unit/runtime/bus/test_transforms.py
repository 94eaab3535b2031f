"""The chain's frames as transforms: put one after the other they are where the kinematics puts them."""

from __future__ import annotations

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.kinematic_chain import ORIGIN, JointFrame, child_frame, mounting_of
from aeros.runtime.bus.messages import Quaternion, TFMessage, Time, TransformStamped
from aeros.runtime.bus.transforms import chain_transforms, frame_quaternion
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.ports import RobotBody, Vec3

NAMES = ("a", "b", "c")
WHEN = Time(1, 500)
ANGLES = st.floats(-4.0, 4.0)
LENGTHS = st.floats(-1.0, 1.0)
ROWS = st.tuples(LENGTHS, ANGLES, LENGTHS)
PLACES = st.tuples(LENGTHS, LENGTHS, LENGTHS)


def turned(by: Quaternion, p: Vec3) -> Vec3:
    """By the definition: the vector part of q·p·q⁻¹."""
    x, y, z, w = by.x, by.y, by.z, by.w
    a, b, c = p
    u, v, t = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return (a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u)


def placed(one: TransformStamped, p: Vec3) -> Vec3:
    """Convert a point from the child's frame to the parent's."""
    x, y, z = turned(one.transform.rotation, p)
    by = one.transform.translation
    return (x + by.x, y + by.y, z + by.z)


def placed_in_first(message: TFMessage, p: Vec3) -> Vec3:
    for one in reversed(message.transforms):
        p = placed(one, p)
    return p


@given(st.tuples(ROWS, ROWS, ROWS), st.tuples(ANGLES, ANGLES, ANGLES), PLACES, PLACES)
def test_the_transforms_lead_to_where_the_tool_is(
    rows: tuple[Vec3, ...], q: tuple[float, ...], tool: Vec3, base: Vec3
) -> None:
    message = chain_transforms(RobotBody(rows, tool, ()), base, NAMES, q, WHEN)
    expected = ForwardKinematics(RobotBody(rows, tool, ()), q).frames[-1].to_base(tool)
    in_world = tuple(a + b for a, b in zip(base, expected, strict=True))
    assert placed_in_first(message, (0.0, 0.0, 0.0)) == pytest.approx(in_world, abs=1e-9)


def test_each_frame_is_in_the_one_before() -> None:
    rows = ((0.0, 0.0, 0.25), (0.5, 0.0, 0.0), (0.5, 0.0, 0.0))
    message = chain_transforms(
        RobotBody(rows, (0.0, 0.0, 0.125), ()), (1.0, 2.0, 0.0), NAMES, (0.0,) * 3, WHEN
    )
    pairs = [(one.header.frame_id, one.child_frame_id) for one in message.transforms]
    assert pairs == [
        ("world", "base"), ("base", "a_link"), ("a_link", "b_link"), ("b_link", "c_link"), ("c_link", "tool"),
    ]  # fmt: skip
    assert {one.header.stamp for one in message.transforms} == {WHEN}


def test_an_unknown_base_has_no_transform() -> None:
    message = chain_transforms(RobotBody(((0.0, 0.0, 0.0),), (0.0, 0.0, 0.0), ()), None, ("a",), (0.0,), WHEN)
    assert [one.child_frame_id for one in message.transforms] == ["a_link", "tool"]


def test_a_chain_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="argument"):
        chain_transforms(RobotBody(((0.0, 0.0, 0.0),), (0.0, 0.0, 0.0), ()), None, NAMES, (0.0,) * 3, WHEN)


HALF = 3.141592653589793


@given(st.lists(st.tuples(ANGLES, ANGLES), max_size=4), PLACES)
def test_a_rotation_is_the_frames_own(turns: list[tuple[float, float]], p: Vec3) -> None:
    assert_rotation(turns, p)


@pytest.mark.parametrize(
    "turns", [[(0.0, HALF)], [(HALF, 0.0)], [(HALF, HALF)], [(HALF / 2, HALF), (0.0, HALF)]]
)
def test_half_turns_about_each_axis_are_too(turns: list[tuple[float, float]]) -> None:
    assert_rotation(turns, (0.25, 0.5, 1.0))


def assert_rotation(turns: list[tuple[float, float]], p: Vec3) -> None:
    frame: JointFrame = ORIGIN
    for tilt, turn in turns:
        frame = child_frame(frame, mounting_of((0.0, tilt, 0.0)), turn)
    found = frame_quaternion(frame)
    assert sqrt(found.x**2 + found.y**2 + found.z**2 + found.w**2) == pytest.approx(1.0, abs=1e-9)
    assert turned(found, p) == pytest.approx(frame.to_base(p), abs=1e-9)

"""Bounds on displacements of planar arms, worked out by hand; tests/property samples random ones."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, pi, sin

import pytest

from aeros.kinematic_chain import PRISMATIC
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics, chord_terms, norm
from aeros.runtime.ports import RobotBody
from tests.unit.runtime.motions import body, chance_of, with_slides

PLANAR = RobotBody(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), (0.25, 0.0, 0.0), ())
"""Two joints about z, half a metre apart."""

STRETCHED = ForwardKinematics(PLANAR, (0.0, 0.0))
TIP = (0.75, 0.0, 0.0)


def test_the_frames_are_those_of_the_chain() -> None:
    bent = ForwardKinematics(PLANAR, (pi / 2, -pi / 2)).frames
    assert len(bent) == 3
    assert bent[-1].to_base(PLANAR.tool_offset) == pytest.approx((0.25, 0.5, 0.0))


def test_a_point_moves_by_each_joints_deviation_times_its_distance() -> None:
    # Joint 2: 0.2 at 0.25 m. Joint 1: 0.1 at 0.75 m, and at 0.05 m more as joint 2 may have moved the tip.
    total, reaches = STRETCHED.displacement_bound(2, TIP, (0.1, 0.2))
    assert total == pytest.approx(0.13)
    assert reaches == pytest.approx([0.8, 0.25])


def test_only_the_joints_that_move_a_point_count() -> None:
    assert STRETCHED.displacement_bound(0, TIP, (0.1, 0.2)) == (0.0, [])
    total, reaches = STRETCHED.displacement_bound(1, (0.0, 0.3, 9.0), (0.1, 0.2))
    assert total == pytest.approx(0.03)
    assert reaches == pytest.approx([0.3])


def test_a_point_on_the_axis_does_not_move() -> None:
    assert STRETCHED.displacement_bound(1, (0.0, 0.0, 2.0), (0.1, 0.2)) == (0.0, [0.0])


def test_the_distance_from_a_tilted_axis_is_across_it() -> None:
    tilted = ForwardKinematics(RobotBody(((0.0, -pi / 2, 0.0),), TIP, ()), (0.0,))  # its axis is y
    total, reaches = tilted.displacement_bound(1, (0.3, 7.0, 0.4), (0.1,))
    assert total == pytest.approx(0.05)
    assert reaches == pytest.approx([0.5])


TERMS = [(0.1, 0.0, 0.1, 0.005), (-0.2, 0.05, 0.25, 0.05625)]
"""0.1·0.1/2, and 0.25·(0.1 + 0.25/2)."""


def test_the_terms_of_a_chord_hold_half_of_each_pair_of_joints() -> None:
    found = chord_terms((0.1, -0.2), (0.0, 0.05), (False, False))
    assert [pytest.approx(row) for row in TERMS] == found
    assert chord_terms((), (), ()) == []
    found = chord_terms((0.1, -0.2, 0.3, -0.1), (0.0, 0.05, 0.0, 0.1), (False,) * 4)
    w = [row[2] for row in found]
    assert sum(row[3] for row in found) == pytest.approx(sum(w) ** 2 / 2.0)


def test_near_a_chord_opposite_effects_of_joints_cancel() -> None:
    edges, near = STRETCHED.chord_deviation_bound(2, TIP, TERMS)
    # 0.75·0.1 - 0.25·0.2 along y.
    assert edges == pytest.approx((0.0, 0.025, 0.0))
    # Off the chord: 0.25·0.05. Bends: 0.25·0.05625 and, with joint 2's 0.0625 m, 0.8125·0.005.
    assert near == pytest.approx(0.0125 + 0.0140625 + 0.0040625)


def test_near_a_chord_only_the_joints_that_move_a_point_count() -> None:
    assert STRETCHED.chord_deviation_bound(0, TIP, TERMS) == ((0.0, 0.0, 0.0), 0.0)
    edges, near = STRETCHED.chord_deviation_bound(1, (0.0, 0.4, 0.0), TERMS)
    assert edges == pytest.approx((0.04, 0.0, 0.0))
    assert near == pytest.approx(0.4 * 0.005)


def test_every_coordinate_of_a_chords_box_is_a_half_edge() -> None:
    # About y, a point at (0.3, 0, 0.4) moves by 0.4 along x and by -0.3 along z for each rad.
    tilted = ForwardKinematics(RobotBody(((0.0, -pi / 2, 0.0),), TIP, ()), (0.0,))
    edges, near = tilted.chord_deviation_bound(1, (0.3, 7.0, 0.4), chord_terms((0.1,), (0.02,), (False,)))
    assert edges == pytest.approx((0.04, 0.0, 0.03))
    assert near == pytest.approx(0.5 * 0.02 + 0.5 * 0.12 * 0.06)


def test_the_length_of_a_vector() -> None:
    assert norm((3.0, -4.0, 12.0)) == 13.0
    assert norm((0.0, 0.0, 0.0)) == 0.0


@pytest.mark.parametrize("turn", [0.0, 0.7, pi / 2, -2.0])
def test_a_distance_does_not_depend_on_where_the_axis_points(turn: float) -> None:
    # Joint 2's axis is y, turned by joint 1; the point, at (0.3, 7, 0.4) before, is turned with it.
    chain = ForwardKinematics(RobotBody(((0.0, 0.0, 0.0), (0.0, -pi / 2, 0.0)), TIP, ()), (turn, 0.0))
    c, s = cos(turn), sin(turn)
    point = (0.3 * c - 7.0 * s, 0.3 * s + 7.0 * c, 0.4)
    _, reaches = chain.displacement_bound(2, point, (0.0, 0.0))
    assert reaches == pytest.approx([hypot(0.3, 7.0), 0.5])
    edges, near = chain.chord_deviation_bound(2, point, chord_terms((0.0, 0.1), (0.0, 0.02), (False, False)))
    assert edges == pytest.approx((abs(0.04 * c), abs(0.04 * s), 0.03))
    assert near == pytest.approx(0.5 * 0.02 + 0.5 * 0.12 * 0.06)


def test_the_distance_from_an_oblique_axis_is_what_pythagoras_leaves() -> None:
    chain = ForwardKinematics(RobotBody(((0.0, 0.0, 0.0), (0.0, 0.7, 0.0)), TIP, ()), (0.9, 0.0))
    # The upright axis tilted by 0.7 about x, and turned by 0.9.
    axis, point = (sin(0.7) * sin(0.9), -sin(0.7) * cos(0.9), cos(0.7)), (0.3, -0.2, 0.5)
    along = sum(a * p for a, p in zip(axis, point, strict=True))
    _, reaches = chain.displacement_bound(2, point, (0.0, 0.0))
    assert reaches[1] == pytest.approx((norm(point) ** 2 - along**2) ** 0.5)


SLIDING = RobotBody(((0.0, 0.0, 0.0), (0.5, -pi / 2, 0.0, 0.0, PRISMATIC), (0.5, pi / 2, 0.0)), TIP, ())
"""Joint 1 turns about z, joint 2 slides along y at half a metre, joint 3 turns about z as far beyond."""


def test_a_prismatic_joint_moves_a_point_by_its_own_way() -> None:
    posture = ForwardKinematics(SLIDING, (0.0, 0.3, 0.0))
    assert posture.frames[3].origin == pytest.approx((1.0, 0.3, 0.0))
    total, reaches = posture.displacement_bound(3, (1.25, 0.3, 0.0), (0.1, 0.2, 0.4))
    # Joint 3: 0.4 at 0.25 m. Joint 2: 0.2. Joint 1: 0.1 at the distance, and at both ways more.
    assert reaches == pytest.approx([hypot(1.25, 0.3) + 0.1 + 0.2, 1.0, 0.25])
    assert total == pytest.approx(0.1 + 0.2 + 0.1 * reaches[0])


def test_a_prismatic_joint_is_no_inner_joint_of_a_pair() -> None:
    found = chord_terms((0.1, 0.2, -0.3), (0.0, 0.0, 0.1), (False, True, False))
    assert [row[3] for row in found] == pytest.approx([0.1 * 0.05, 0.2 * 0.1, 0.4 * (0.1 + 0.2)])


def test_beyond_and_before_a_prismatic_joint_bends_are_of_the_joints_that_turn() -> None:
    posture = ForwardKinematics(SLIDING, (0.0, 0.3, 0.0))
    terms = chord_terms((0.1, 0.2, 0.4), (0.0, 0.0, 0.0), posture.slides)
    _, near = posture.chord_deviation_bound(3, (1.25, 0.3, 0.0), terms)
    # Joint 3 bends at 0.25 m, with itself and joint 1. Joint 2's own way turns with joint 1. Joint 1's reach
    # is longer by 0.1 m of joint 3 and by joint 2's way.
    assert near == pytest.approx(0.25 * 0.4 * 0.3 + 0.2 * 0.1 + (hypot(1.25, 0.3) + 0.1 + 0.2) * 0.005)


@pytest.mark.parametrize("seed", range(6))
def test_a_small_displacement_is_that_of_differences(seed: int) -> None:
    chance, step = chance_of(seed), 1e-6
    robot = with_slides(body(chance), chance) if seed % 2 else body(chance)
    q = [chance.uniform(-2.0, 2.0) for _ in range(4)]
    d = [chance.uniform(-1.0, 1.0) for _ in range(4)]
    posture = ForwardKinematics(robot, q)
    point = posture.frames[-1].to_base(robot.tool_offset)

    def displaced(by: Sequence[float]) -> list[float]:
        ends = [
            ForwardKinematics(robot, [x + sign * step * y for x, y in zip(q, by, strict=True)])
            .frames[-1]
            .to_base(robot.tool_offset)
            for sign in (1.0, -1.0)
        ]
        return [(a - b) / (2.0 * step) for a, b in zip(*ends, strict=True)]

    _, reaches = posture.displacement_bound(4, point, (0.0,) * 4)
    each = [hypot(*displaced([float(one == joint) for one in range(4)])) for joint in range(4)]
    assert reaches == pytest.approx(each, abs=1e-7)
    edges, near = posture.chord_deviation_bound(4, point, chord_terms(d, (0.0,) * 4, posture.slides))
    assert edges == pytest.approx([*map(abs, displaced(d))], abs=1e-7)
    room = (0.01, 0.02, 0.0, 0.03)
    _, wider = posture.chord_deviation_bound(4, point, [(0.0, r, 0.0, 0.0) for r in room])
    assert wider == pytest.approx(sum(r * reach for r, reach in zip(room, each, strict=True)), abs=1e-7)
    assert near > 0.0


def test_a_chord_of_a_prismatic_joint_alone_is_enclosed_exactly() -> None:
    posture = ForwardKinematics(SLIDING, (0.0, 0.3, 0.0))
    terms = chord_terms((0.0, 0.2, 0.0), (0.0, 0.05, 0.0), posture.slides)
    edges, near = posture.chord_deviation_bound(3, (1.25, 0.3, 0.0), terms)
    assert edges == pytest.approx((0.0, 0.2, 0.0))
    assert near == pytest.approx(0.05)

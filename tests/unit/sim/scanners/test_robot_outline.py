"""The robot from above: its carriage, its links and how far off the carriage is."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from aeros.kinematic_chain import frames_of, mounting_of
from aeros.sim.robot.standing_arms.standing_arm import with_standing_arms
from aeros.sim.scanners.robot_outline import RobotOutline
from tests.unit.sim.robot.panda import CAPSULES, PANDA, PANDA_BODY
from tests.unit.sim.robot.standing_arms.two_armed_robots import two_pandas
from tests.unit.sim.scanners.cells import READY

REACHING_DOWN = (0.0, 1.75, 0.0, -0.4, 0.0, 2.0, 0.8)
"""A posture whose hand is below the arm's base."""


def outline(joints: tuple[float, ...] = READY, *, carriage: bool = True) -> RobotOutline:
    return RobotOutline(PANDA, joints, (1.0, 2.0, 0.0), carriage=carriage)


def test_the_carriage_covers_its_rectangle() -> None:
    points = np.array([(1.24, 2.22), (1.26, 2.0), (1.0, 1.77), (1.26, 2.25)])
    assert outline().covers(points).tolist() == [True, False, False, False]
    assert outline().covers(points, 0.0101).tolist() == [True, True, True, False]
    assert not outline(carriage=False).covers(points, 0.1).any()


def test_the_distance_is_that_of_the_nearest_link_or_of_the_carriage() -> None:
    beside = np.array([(1.0, 5.0)])
    assert outline().distance(beside) == pytest.approx(3.0 - 0.225)
    ahead = np.array([(4.0, 2.0)])
    frames = frames_of([mounting_of(row) for row in PANDA_BODY.dh_rows], READY)
    reach = max(frames[one.joint].to_base(end)[0] + one.radius for one in CAPSULES for end in (one.a, one.b))
    assert outline().distance(ahead) == pytest.approx(3.0 - reach, abs=1e-3)
    assert outline().distance(np.array([(1.1, 2.1)])) == 0.0


def test_a_standing_arm_is_a_part_of_the_robot() -> None:
    both = RobotOutline(two_pandas(), READY, (1.0, 2.0, 0.0), carriage=True)
    beside = np.array([(1.0, 5.0)])
    assert both.distance(beside) < outline().distance(beside) - 0.3
    assert both.distance(np.array([(1.0, -1.0)])) == outline().distance(np.array([(1.0, -1.0)]))
    # Its foot stands on the base, as the other one does, and is no less seen for that.
    assert both.reaches_down_to(0.1)
    assert not outline().reaches_down_to(0.1)
    foot = np.array([(1.0, 2.5)])
    assert both.covers_with_links(foot, 0.05, 0.0).tolist() == [True]
    assert outline().covers_with_links(foot, 0.05, 0.0).tolist() == [False]


def test_a_person_may_be_nearer_to_a_standing_arm_by_its_tolerance() -> None:
    (arm,), ahead = two_pandas().standing_arms, np.array([(1.5, 0.5)])
    inside = np.array([(x, y) for x in np.arange(-0.5, 0.6, 0.02) for y in np.arange(0.0, 1.0, 0.02)])

    def standing(tolerance: float, posture: tuple[float, ...] = arm.posture) -> RobotOutline:
        one = replace(arm, posture=posture, tolerance=(tolerance,) * 7)
        return RobotOutline(with_standing_arms(PANDA, [one]), READY, (0.0, 0.0, 0.0), carriage=False)

    exact, loose = standing(0.0), standing(0.05)
    assert loose.distance(ahead) < exact.distance(ahead) - 0.05
    for signs in product((-0.05, 0.05), repeat=4):
        off = tuple(np.add(arm.posture, (0.0, *signs, 0.0, 0.0)).tolist())
        assert standing(0.0, off).distance(ahead) >= loose.distance(ahead)
    # What is in the way of a ray there may be a person: it is not taken for the arm.
    covered = exact.covers_with_links(inside, 0.4, 0.0)
    assert covered.any()
    assert (loose.covers_with_links(inside, 0.4, 0.0) == covered).all()


def test_an_arm_that_reaches_down_covers_what_is_below_its_base() -> None:
    assert not outline().reaches_down_to(-0.1)
    down = outline(REACHING_DOWN)
    assert down.reaches_down_to(-0.1)
    frames = frames_of([mounting_of(row) for row in PANDA_BODY.dh_rows], REACHING_DOWN)
    hand = next(one for one in CAPSULES if one.link == "fingers")
    x, y, z = frames[hand.joint].to_base(hand.a)
    at = np.array([(1.0 + x, 2.0 + y), (3.0, 2.0)])
    assert down.covers_with_links(at, z, 0.0).tolist() == [True, False]


def test_points_on_its_sides_show_the_displacement_of_the_carriage() -> None:
    front = np.column_stack((np.full(9, 1.25), np.linspace(1.8, 2.2, 9)))
    left = np.column_stack((np.linspace(0.8, 1.2, 9), np.full(9, 2.225)))
    sides = np.add(np.concatenate((front, left)), (0.03, -0.02))
    assert outline().offset_of_carriage(sides) == pytest.approx((0.03, -0.02), abs=5e-3)
    assert outline().offset_of_carriage(np.add(front[:3], (0.03, 0.0))).tolist() == [0.0, 0.0]

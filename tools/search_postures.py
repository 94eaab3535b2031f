"""Choose the postures at which inverse kinematics of a new arm begins: `search` of a robot file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Final

import numpy as np

from aeros.kinematic_chain import Row
from aeros.runtime.ports import RobotBody
from aeros.sim.robot.kinematics import forward_kinematics, solve_ik, solve_ik_one
from aeros.sim.robot.model import Postures, RobotModel
from aeros.sim.robot.profile import UnreachableError, line_path
from aeros.sim.robot.robot_file import reference_robot
from tools.fit_link_hulls import Points

_PLACES: Final = (*product((0.3, 0.45, 0.6), (-0.3, 0.0, 0.3), (-0.2, 0.05, 0.2, 0.36)),)
"""Places of the tool to reach from the base, m."""

_YAWS: Final = (0.0, np.pi / 2.0, np.pi, -np.pi / 2.0)

_MOST: Final = 6
"""Greatest number of postures: each takes time where a target is out of reach."""

_TRIES: Final = 12
"""Random starts for a pose that is not solved."""

_LEAST: Final = 2
"""Poses that a posture has to solve."""


def search_postures(
    rows: tuple[Row, ...], reach: float, turn: float, ends: tuple[Points, Points], ready: Points
) -> tuple[list[float], list[list[float]]]:
    """Choose weights of `lean` and rows of `search`.

    Poses before the arm that the ready posture does not lead to are solved from random postures. Of these
    solutions, taken as differences from the ready posture turned to the pose, those are chosen that lead to
    the most other poses.

    Args:
        rows: modified Denavit-Hartenberg parameters of the chain.
        reach: distance of the tool centre point from the last joint's frame, m.
        turn: angle by which the hand is mounted turned, rad.
        ends: lowest and highest joint positions, each (joints,), rad or m.
        ready: the ready posture (joints,), rad or m.

    Returns:
        The weights, one for each joint, and the rows, rad or m.
    """
    arm = _arm(rows, reach, turn, ends, ready)
    lean = arm.postures.lean_weights
    poses = [(np.array(place), yaw) for place, yaw in product(_PLACES, _YAWS)]
    unsolved = [pose for pose in poses if solve_ik_one(arm, *pose, ready) is None]
    candidates = [one for pose in unsolved if (one := _difference(arm, *pose)) is not None]
    chosen: list[Points] = []
    while candidates and unsolved and len(chosen) < _MOST:
        solved = [[_leads_to(arm, one, *pose) for pose in unsolved] for one in candidates]
        counts = [sum(row) for row in solved]
        best = int(np.argmax(counts))
        if counts[best] < _LEAST:
            break
        chosen.append(candidates.pop(best))
        unsolved = [pose for pose, done in zip(unsolved, solved[best], strict=True) if not done]
    return lean.tolist(), [one.round(3).tolist() for one in chosen]


def count_lines(
    rows: tuple[Row, ...],
    reach: float,
    turn: float,
    ends: tuple[Points, Points],
    ready: Points,
    is_free: Callable[[Points], bool],
) -> int:
    """Count the places to which the tool gets from a ready posture along a straight line.

    Args:
        rows: modified Denavit-Hartenberg parameters of the chain.
        reach: distance of the tool centre point from the last joint's frame, m.
        turn: angle by which the hand is mounted turned, rad.
        ends: lowest and highest joint positions, each (joints,), rad or m.
        ready: the ready posture (joints,), rad or m.
        is_free: returns True if no links meet in a posture.

    Returns:
        How many of the places before the arm and beside it are reached with yaw 0, in postures in which no
        links meet.
    """
    arm = _arm(rows, reach, turn, ends, ready)
    (start,), _, _ = forward_kinematics(arm, ready[None, :])
    count = 0
    for place in _PLACES:
        try:
            path = line_path(arm, ready, (start, 0.0), (np.array(place), 0.0))
        except UnreachableError:
            continue
        count += is_free(np.array(path[-1][-1]))
    return count


def _arm(
    rows: tuple[Row, ...], reach: float, turn: float, ends: tuple[Points, Points], ready: Points
) -> RobotModel:
    """Return the arm as far as inverse kinematics needs it."""
    known, lean = reference_robot(), np.ones(len(rows))
    arm = replace(
        known,
        body=RobotBody(rows, (0.0, 0.0, reach), (), (), ()),
        limits=replace(known.limits, lowest=ends[0], highest=ends[1]),
        hand=replace(known.hand, turn=turn),
        postures=Postures(ready, lean, ()),
    )
    lean[[*arm.turning_ends]] = 0.0
    return arm


def _turned(arm: RobotModel, place: Points, yaw: float) -> Points:
    """Return the ready posture turned to a pose, as `solve_ik_one` begins with it."""
    bearing = float(np.arctan2(place[1], place[0]))
    turned = arm.postures.ready.copy()
    first, last = arm.turning_ends
    turned[first] += bearing
    turned[last] += bearing - yaw
    return np.clip(turned, arm.limits.lowest, arm.limits.highest)


def _difference(arm: RobotModel, place: Points, yaw: float) -> Points | None:
    """Find a solution from random postures, and return its difference from the turned ready posture."""
    random = np.random.default_rng(0)
    for _ in range(_TRIES):
        start = random.uniform(arm.limits.lowest, arm.limits.highest)
        found = solve_ik(arm, place[None, :], np.array([yaw]), start[None, :])
        if found is not None:
            difference: Points = (found[0] - _turned(arm, place, yaw)).round(3)
            return difference
    return None


def _leads_to(arm: RobotModel, difference: Points, place: Points, yaw: float) -> bool:
    start = _turned(arm, place, yaw) + difference
    return solve_ik(arm, place[None, :], np.array([yaw]), start[None, :]) is not None

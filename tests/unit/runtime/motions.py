"""Random robots and random smooth motions of theirs, for the bounds on motions."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import pi
from random import Random

from aeros.kinematic_chain import PRISMATIC
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.ports import Ball, JointPath, JointVector, RobotBody, Trajectory, Vec3

JOINTS = 4


def chance_of(seed: int) -> Random:
    """Numbers that repeat."""
    return Random(seed)  # noqa: S311 - nothing here is secret


def body(chance: Random) -> RobotBody:
    """A chain of four joints with a ball or two on each link."""
    rows = tuple(
        (chance.uniform(0, 0.3), chance.uniform(-pi, pi), chance.uniform(0, 0.3)) for _ in range(JOINTS)
    )
    balls = tuple(
        Ball(f"link{joint}", joint, _triple(chance, 0.2), chance.uniform(0.01, 0.1))
        for joint in range(JOINTS + 1)
        for _ in range(2)
    )
    return RobotBody(rows, _triple(chance, 0.2), balls)


def with_slides(robot: RobotBody, chance: Random) -> RobotBody:
    """The robot with one to three of its joints prismatic."""
    sliding = chance.sample(range(JOINTS), chance.randint(1, 3))
    rows = tuple(
        (a, alpha, d, chance.uniform(-pi, pi), PRISMATIC) if number in sliding else (a, alpha, d)
        for number, (a, alpha, d, *_) in enumerate(robot.dh_rows)
    )
    return replace(robot, dh_rows=rows)


def path(chance: Random, pieces: int = 3, stride: float = 0.2) -> JointPath:
    """A cubic B-spline by its Bézier pieces: its second derivative has no jumps."""
    points = [[chance.uniform(-1.0, 1.0) for _ in range(JOINTS)]]
    for _ in range(pieces + 2):
        points.append([q + chance.uniform(-stride, stride) for q in points[-1]])
    found = []
    for i in range(pieces):
        a, b, c, d = points[i : i + 4]
        found.append(
            (_mix(a, b, c, 1, 4, 1), _mix(a, b, c, 0, 4, 2), _mix(a, b, c, 0, 2, 4), _mix(b, c, d, 1, 4, 1))
        )
    return tuple(found)


def _mix(a: list[float], b: list[float], c: list[float], u: int, v: int, w: int) -> JointVector:
    return tuple((u * x + v * y + w * z) / 6.0 for x, y, z in zip(a, b, c, strict=True))


def _triple(chance: Random, most: float) -> Vec3:
    return (chance.uniform(-most, most), chance.uniform(-most, most), chance.uniform(-most, most))


def at(path: JointPath, s: float) -> JointVector:
    """The joint positions at s."""
    n = len(path)
    index = min(int(s * n), n - 1)
    u = s * n - index
    v = 1.0 - u
    return tuple(
        v**3 * a + 3 * v * v * u * b + 3 * v * u * u * c + u**3 * d
        for a, b, c, d in zip(*path[index], strict=True)
    )


def share(u: float) -> float:
    """s at the share u of the duration."""
    return u**3 * (10.0 - 15.0 * u + 6.0 * u * u)


def places(motion: Trajectory, s: float) -> list[Vec3]:
    """Compute the centres of the body's balls, in W."""
    posture = ForwardKinematics(motion.body, at(motion.joint_paths[0], s))
    base = [b + s * w for b, w in zip(motion.base, motion.base_path, strict=True)]
    found = []
    for ball in motion.body.balls:
        x, y, z = posture.frames[ball.joint].to_base(ball.centre)
        found.append((x + base[0], y + base[1], z + base[2]))
    return found


def tool(motion: Trajectory, s: float) -> Vec3:
    """Compute the tool's position, in W."""
    x, y, z = (
        ForwardKinematics(motion.body, at(motion.joint_paths[0], s))
        .frames[-1]
        .to_base(motion.body.tool_offset)
    )
    bx, by, bz = (b + s * w for b, w in zip(motion.base, motion.base_path, strict=True))
    return (x + bx, y + by, z + bz)


def differences(values: list[float], step: float) -> list[float]:
    """Divided differences of neighbours."""
    return [(b - a) / step for a, b in pairwise(values)]

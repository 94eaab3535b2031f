"""Judges a run by ground truth: what every link's speed was while how near a person was.

Speeds are of the robot's own points, from one tick to the next, by its joints and its base; no reading and
nothing that decided is asked.  The rule is that of the reference site, read from its file.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from aeros.sim.clock import TICK
from aeros.sim.sensors import GroundTruth
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr.terms import Literal
from aeros.spec.text.discovery import reference_site_path
from tests.unit.sim.robot.panda import CAPSULES, PANDA_BODY

Vector = NDArray[np.float64]

REST = 0.01
"""Speed up to which a link rests, m/s: what is left of an arm that settles."""

TRACKING = 1.01
"""A link is faster than its set points by this much at most."""


@cache
def of_the_site(name: str) -> float:
    """A constant of the reference site, SI."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    constant = site.constants[name]
    assert isinstance(constant, Literal)
    return float(constant.value)


class Referee:
    """Listener to the true values of every tick; `breaches` lists what was wrong."""

    def __init__(self) -> None:
        self._truths: list[GroundTruth] = []

    def __call__(self, truth: GroundTruth) -> None:
        self._truths.append(truth)

    def of(self, name: str) -> Vector:
        """Return the true values of a variable, tick by tick."""
        return np.array([truth.values[name] for truth in self._truths])

    @property
    def distances(self) -> Vector:
        """Of the nearest person, after the first tick."""
        return self.of("human_distance")[1:]

    def link_speeds(self) -> Vector:
        """Of the fastest link, m/s, after the first tick."""
        points = points_of(self.of("joint_position")) + self.of("base_position")[:, None, :]
        steps: Vector = np.linalg.norm(np.diff(points, axis=0), axis=2) / TICK
        fastest: Vector = steps.max(axis=1)
        return fastest

    def base_speeds(self) -> Vector:
        """Of the carriage, m/s, after the first tick."""
        speeds: Vector = np.linalg.norm(np.diff(self.of("base_position"), axis=0), axis=1) / TICK
        return speeds

    def separations(self) -> tuple[Vector, Vector]:
        """S = v_h·(T_r + T_s) + v_r·T_r + v_r·T_s/2 + C + Z_d + Z_r, m, and T_s, s, at each speed."""
        v, base = self.link_speeds(), self.base_speeds()
        arm_moves = v > base + REST
        stopping = np.where(
            arm_moves, of_the_site("arm_stopping_time"), base / of_the_site("drive_deceleration")
        )
        reaction = of_the_site("reaction_time")
        needed = (
            of_the_site("walking_speed") * (reaction + stopping)
            + v * reaction
            + v * stopping / 2.0
            + of_the_site("intrusion_distance")
            + of_the_site("person_uncertainty")
            + of_the_site("robot_uncertainty")
        )
        return needed, stopping

    def breaches(self) -> list[str]:
        """Whenever a link was faster or nearer than the site allows.

        Nearer it may be while it brakes: within T_r + T_s, no link gets faster after T_r, and no person is
        nearer than C + Z_r. Faster it may never be, nor while it brakes.
        """
        v, d = self.link_speeds(), self.distances
        needed, stopping = self.separations()
        reaction = of_the_site("reaction_time")
        least = of_the_site("intrusion_distance") + of_the_site("robot_uncertainty")
        found = []
        for what, broken in (
            ("too near", (v > REST) & (d < needed)),
            (
                "too fast",
                (v > TRACKING * of_the_site("reduced_speed")) & (d < of_the_site("warning_distance")),
            ),
        ):
            for begin, end in _runs(broken):
                lasted, allowed = (end - begin) * TICK, reaction + stopping[begin]
                fastest, nearest = v[begin:end].max(), d[begin:end].min()
                reacted = min(end, begin + 1 + round(reaction / TICK))
                got_faster = fastest > TRACKING * v[begin:reacted].max() + REST
                if what == "too fast" or lasted > allowed or got_faster or nearest < least:
                    found.append(
                        f"{what} at {(begin + 1) * TICK:.2f} s, for {lasted:.2f} s of {allowed:.2f} s: "
                        f"up to {fastest:.3f} m/s, {nearest:.3f} m near"
                    )
        return found


def points_of(q: Vector) -> Vector:
    """Both ends of every link's capsule in the base's frame, (n, points, 3), for q (n, 7)."""
    n = len(q)
    rotations, origins = [np.broadcast_to(np.eye(3), (n, 3, 3))], [np.zeros((n, 3))]
    for joint, (a, alpha, offset, *_) in enumerate(PANDA_BODY.dh_rows):
        ca, sa = np.cos(alpha), np.sin(alpha)
        c, s = np.cos(q[:, joint]), np.sin(q[:, joint])
        zero, one = np.zeros(n), np.ones(n)
        step = np.array([[c, -s, zero], [s * ca, c * ca, -sa * one], [s * sa, c * sa, ca * one]])
        origins.append(origins[-1] + rotations[-1] @ np.array([a, -sa * offset, ca * offset]))
        rotations.append(rotations[-1] @ step.transpose(2, 0, 1))
    ends = [
        origins[capsule.joint] + rotations[capsule.joint] @ np.array(end)
        for capsule in CAPSULES
        for end in (capsule.a, capsule.b)
    ]
    return np.stack(ends, axis=1)


def _runs(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the first index of each run of True, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)

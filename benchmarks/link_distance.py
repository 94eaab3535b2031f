"""Decide postures by the distances between links: `python -m benchmarks.link_distance`.

Judge: PyBullet's distance between the convex hulls of the links' collision meshes (panda.urdf).

- *used*: postures that the shipped tasks visit on the kinematic plant, and postures halfway between two of
  them on a motion of the joints. A denial of one in which no two links are nearer than the site's clearance
  is a false alarm.
- *colliding*: random postures inside the joint limits in which two links overlap. If one is not denied, it is
  a miss.

Prints both counts, the least distance that was seen in use, and how long a decision of a posture takes.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from io import StringIO
from statistics import median
from typing import Any, Final

import numpy as np

from aeros.cli.main import main as run_aeros
from aeros.runtime.motion.link_distance import find_link_contact
from aeros.runtime.motion.swept_volume import SweptMotion
from aeros.sim.bullet.client import DATA, bullet
from aeros.sim.kinematic.robot import KinematicRobot
from aeros.sim.robot.robot_file import reference_robot
from benchmarks.command import build_parser, print_json

_TASKS: Final = ("make dumplings", "clean the table", "fetch the object")

ROBOT: Final = reference_robot()

_CLEARANCE: Final = 0.010
"""`link_clearance` of the reference site, m."""

_LINK_INDICES: Final = {
    "foot": (-1,),
    **{f"link{number}": (number - 1,) for number in range(1, 8)},
    "hand": (8,),
    "fingers": (9, 10),
}
"""Links of panda.urdf, in PyBullet's order."""


def postures_in_use(seeds: int) -> np.ndarray[Any, Any]:
    """Run the shipped tasks and collect the joint positions (n, 7) that the arm visits, rad."""
    seen: list[tuple[float, ...]] = []
    sense = KinematicRobot.read_sensors

    def spy(robot: KinematicRobot) -> Any:
        state = sense(robot)
        seen.append(state.q)
        return state

    KinematicRobot.read_sensors = spy  # type: ignore[method-assign,assignment]
    try:
        for seed in range(seeds):
            for task in _TASKS:
                with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(StringIO()):
                    where = ("--out", f"{folder}/out", "--state", f"{folder}/state")
                    status = run_aeros(["run", task, "--plant", "kinematic", "--seed", str(seed), *where])
                if status:
                    raise SystemExit(f"`{task}` with seed {seed} did not reach its goal")
    finally:
        KinematicRobot.read_sensors = sense  # type: ignore[method-assign]
    return np.unique(np.array(seen), axis=0)


def is_denied(q: np.ndarray[Any, Any]) -> bool:
    """Return True if the gate would deny to stand there."""
    point = tuple(q.tolist())
    still = SweptMotion(ROBOT.body, ([(point,) * 4],), (0.0,) * 7, (0.0,) * 3, (0.0,) * 3, True)
    return find_link_contact(still, _CLEARANCE) is not None


class MeshJudge:
    """Distances between the links' collision meshes by PyBullet, without AEROS."""

    def __init__(self) -> None:
        self._client = bullet.connect(bullet.DIRECT)
        path = os.path.join(DATA, "franka_panda", "panda.urdf")
        self._body = bullet.loadURDF(path, useFixedBase=True, physicsClientId=self._client)
        joints = {
            name: 0 if name == "foot" else int(name[4:]) if name[4:].isdigit() else 7
            for name in _LINK_INDICES
        }
        self._pairs = [
            (a, b)
            for first, links in _LINK_INDICES.items()
            for second, others in _LINK_INDICES.items()
            if joints[second] - joints[first] >= (1 if second in ("hand", "fingers") else 2)
            for a in links
            for b in others
        ]

    def distance(self, q: np.ndarray[Any, Any], gap: float, within: float) -> float:
        """Measure the least distance of two links that no joint connects, m; `within` if all are farther."""
        for joint, position in enumerate((*q, *(0.0,) * 2, gap / 2.0, gap / 2.0)):
            bullet.resetJointState(self._body, joint, position, physicsClientId=self._client)
        least = within
        for a, b in self._pairs:
            found = bullet.getClosestPoints(
                self._body, self._body, within, a, b, physicsClientId=self._client
            )
            least = min([least, *(point[8] for point in found)])
        return least


def _colliding(judge: MeshJudge, chance: np.random.Generator) -> Iterator[np.ndarray[Any, Any]]:
    while True:
        q = chance.uniform(ROBOT.limits.lowest, ROBOT.limits.highest)
        if judge.distance(q, chance.uniform(0.0, 0.08), 0.001) < 0.0:
            yield q


def measure(count: int, seeds: int) -> dict[str, Any]:
    """Decide `count` postures in use and `count` that collide."""
    chance, judge = np.random.default_rng(0), MeshJudge()
    visited = postures_in_use(seeds)
    used = visited[chance.choice(len(visited), count // 2, replace=len(visited) < count // 2)]
    ends = visited[chance.integers(len(visited), size=(count - len(used), 2))]
    used = np.concatenate((used, ends.mean(axis=1)))
    alarms, least, times = 0, 1.0, []
    for q in used:
        began = time.process_time()
        denied = is_denied(q)
        times.append(time.process_time() - began)
        distance = judge.distance(q, 0.08, 0.05)
        least = min(least, distance)
        alarms += denied and distance >= _CLEARANCE
    colliding = _colliding(judge, chance)
    misses = sum(not is_denied(next(colliding)) for _ in range(count))
    return {
        "used": len(used),
        "false_alarms": alarms,
        "least_distance_mm": 1000.0 * least,
        "colliding": count,
        "misses": misses,
        "median_ms": 1000.0 * median(times),
    }


def main() -> None:
    """Measure and print."""
    options = build_parser(__doc__, "300 postures of each kind").parse_args()
    found = measure(300, 1) if options.quick else measure(10_000, 3)
    if options.format == "json":
        print_json(found)
    else:
        for name, figure in found.items():
            print(f"{name:20} {figure:.6g}")


if __name__ == "__main__":
    main()

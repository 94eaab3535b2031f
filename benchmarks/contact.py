"""Measure the force on obstacles that the arm runs into: `python -m benchmarks.contact`.

A spring-like obstacle of a stated stiffness stands in the arm's way: a hand, a thigh, a wooden post. The arm
runs into it with closed fingers, in three postures and at several speeds, under the monitor of the reference
site. A referee that hooks PyBullet's `stepSimulation` adds up the contact forces on the obstacle after every
tick; no number of AEROS is used. A hand and a thigh are held fast, so that they cannot recoil.

The finger pads of the model are soft (30 N/mm) and lie in series with the obstacle. Two contact points share
a force.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any, Final

from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.ports import MotionCompletion
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.engine import BulletEngine
from aeros.sim.clock import TICK
from aeros.sim.engine.engine import Engine
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.geometry import Vector3
from aeros.sim.physics import PhysicsPlant
from aeros.sim.randomness import RandomSource
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.scenes.load import load_scene
from aeros.spec.text.discovery import reference_site_path
from benchmarks.command import build_parser, print_json

OBSTACLES: Final = {"hand": 75.0, "thigh": 50.0, "wooden post": 1000.0}
"""Stiffness of each obstacle, N/mm: regions by ISO/TS 15066, table A.3; a post is as good as rigid."""

WAYS: Final[dict[str, tuple[Vector3, Vector3]]] = {
    "forward": ((0.35, 0.0, 0.35), (0.75, 0.0, 0.35)),
    "sideways": ((0.5, -0.3, 0.25), (0.5, 0.3, 0.25)),
    "down": ((0.5, 0.0, 0.5), (0.5, 0.0, 0.1)),
}
"""Start and target of the tool in W, m; the obstacle is half-way."""

SPEEDS: Final = (0.05, 0.1, 0.2, 0.25, 0.3, 0.45)
"""Peak speeds of the tool, m/s."""

_RADIUS: Final = 0.05
_DAMPING_SHARE: Final = 0.1
_MASS: Final = 8.0
"""Radius of the obstacle, m; its damping as a share of critical damping, for a mass like the arm's, kg."""

_WATCHED_S: Final = 3.0
"""Time after the first touch, s."""

_HELD_S: Final = 0.5
"""Time after which a contact counts as quasi-static, s: ISO/TS 15066."""


@dataclass(frozen=True)
class Collision:
    """Forces of one collision.

    Attributes:
        obstacle: name of the obstacle.
        stiffness: N/mm.
        way: name of the way.
        speed: peak speed that was asked for, m/s.
        touch_speed: measured speed of the tool point in the tick before the first touch, m/s.
        peak: greatest force in the first 0.5 s, N.
        held: greatest force later, N.
        reason: end of the motion.
    """

    obstacle: str
    stiffness: float
    way: str
    speed: float
    touch_speed: float
    peak: float
    held: float
    reason: str


class _ObstacleScene(PhysicsScene):
    """A ball of a stiffness half-way along a way."""

    def __init__(self, way: tuple[Vector3, Vector3], stiffness: float) -> None:
        super().__init__(load_scene("bare"))
        self._way = way
        self._stiffness = 1000.0 * stiffness
        self.bodies = (-1, -1)

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        super().build(engine, robot, chance)
        assert isinstance(engine, BulletEngine)  # noqa: S101  for the type checker
        world = engine.world
        start, target = self._way
        length = math.dist(start, target)
        middle = [a + (b - a) * (0.5 + _RADIUS / length) for a, b in zip(start, target, strict=True)]
        shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=_RADIUS, physicsClientId=world.client)
        ball = bullet.createMultiBody(0, shape, -1, middle, physicsClientId=world.client)
        bullet.changeDynamics(
            ball,
            -1,
            contactStiffness=self._stiffness,
            contactDamping=2.0 * _DAMPING_SHARE * math.sqrt(self._stiffness * _MASS),
            lateralFriction=0.6,
            physicsClientId=world.client,
        )
        self.bodies = (robot.body, ball)


@contextmanager
def _referee(scene: _ObstacleScene, note: Callable[[float], None]) -> Iterator[None]:
    """Note the force on the obstacle after every step of PyBullet while the block runs."""
    step = bullet.stepSimulation

    def stepped(**named: Any) -> None:
        step(**named)
        force = [0.0, 0.0, 0.0]
        for point in bullet.getContactPoints(*scene.bodies, **named) or ():
            parts = ((point[9], point[7]), (point[10], point[11]), (point[12], point[13]))
            for size, direction in parts:
                force = [a + size * b for a, b in zip(force, direction, strict=True)]
        note(math.hypot(*force))

    bullet.stepSimulation = stepped
    try:
        yield
    finally:
        bullet.stepSimulation = step


def collide(site: Site, obstacle: str, stiffness: float, way: str, speed: float) -> Collision:
    """Run into an obstacle once.

    Args:
        site: its monitor stops the motion.
        obstacle: its name.
        stiffness: N/mm.
        way: a key of `WAYS`.
        speed: peak speed of the tool, m/s.

    Returns:
        The forces.
    """
    scene = _ObstacleScene(WAYS[way], stiffness)
    plant = PhysicsPlant(scene, 0)
    forces: list[float] = []
    speeds: list[float] = []
    try:
        for action in (act("grip", width=0.0, force=10.0), _move(WAYS[way][0], 0.3)):
            _execute(plant, site, action)
        with _referee(scene, forces.append):
            reason = _execute(plant, site, _move(WAYS[way][1], speed), speeds)
            plant.advance(lambda now, values: None, plant.now() + _WATCHED_S)
    finally:
        plant.close()
    touch = next((number for number, force in enumerate(forces) if force > 0.0), len(forces) - 1)
    held = touch + round(_HELD_S / TICK)
    return Collision(
        obstacle, stiffness, way, speed, speeds[min(touch, len(speeds) - 1)],
        max(forces[touch:held]), max(forces[held:]), reason,
    )  # fmt: skip


def _move(target: Vector3, speed: float) -> Action:
    return act("move_tool", target=target, yaw=0.0, speed=speed)


def _execute(plant: PhysicsPlant, site: Site, action: Action, speeds: list[float] | None = None) -> str:
    """Execute an action under the site's monitor; return how it ended."""
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    monitor.add(ActiveAction(action, plant.observe(), plant.now(), 0))

    def watched(now: float, values: Any) -> str | None:
        if speeds is not None:
            speeds.append(values["tool_speed"])
        return monitor(now, values)

    motion = plant.begin(action)
    if isinstance(motion, MotionCompletion):
        raise SystemExit(f"the plant refuses the motion: {motion.reason}")
    return plant.advance(watched, math.inf)[motion].reason or "completed"


ALL_PAIRS: Final = tuple(product(OBSTACLES, WAYS))
"""Every obstacle in every posture."""


def measure(
    site: Site, speeds: Sequence[float], pairs: Sequence[tuple[str, str]] = ALL_PAIRS
) -> list[Collision]:
    """Run into obstacles.

    Args:
        site: its monitor stops the motions.
        speeds: peak speeds of the tool, m/s.
        pairs: obstacles, each with a way.

    Returns:
        All collisions.
    """
    return [
        collide(site, obstacle, OBSTACLES[obstacle], way, speed)
        for obstacle, way in pairs
        for speed in speeds
    ]


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    arguments = build_parser(__doc__, "one speed, each obstacle in one posture").parse_args(argv)
    site = load_site(reference_site_path(), Diagnostics())
    if site is None:
        raise SystemExit("the reference site has faults: `aeros verify` lists them")
    few = SPEEDS[1:2], tuple(zip(OBSTACLES, WAYS, strict=True))
    found = measure(site, *few) if arguments.quick else measure(site, SPEEDS)
    if arguments.format == "json":
        print_json([asdict(one) for one in found])
        return
    print("| obstacle | N/mm | way | asked, m/s | at touch, m/s | peak, N | after 0.5 s, N | stopped by |")
    print("|---|---|---|---|---|---|---|---|")
    for one in found:
        print(
            f"| {one.obstacle} | {one.stiffness:g} | {one.way} | {one.speed:g} | {one.touch_speed:.2f}"
            f" | {one.peak:.0f} | {one.held:.0f} | {one.reason.removeprefix('monitor:')} |"
        )


if __name__ == "__main__":
    main()

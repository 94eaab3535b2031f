"""What each kind of fault does, tick by tick, and how several at once act together.

A physical fault is an iterator, like a motion: it pushes a body or says what it does to the robot's
parts, and yields once a tick.  What is said of one part is put together so that order does not matter.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, inf, pi, sin

import numpy as np
from numpy.random import Generator

from aeros.sim.faults.model import Bump, Delay, Loosen, Misplace, Miss, Physical, Seen, Slip, Weaken
from aeros.sim.limits import Vector
from aeros.sim.panda import Panda
from aeros.sim.profile import TICK
from aeros.sim.scenes.scene import Detected, Scene
from aeros.sim.world import Triple, World


@dataclass
class Hindrance:
    """What the robot's parts can do at most, in one tick; each fault lowers it.

    friction: of the finger pads; force: of the grip, N; strength: share of the arm's torque.
    lag: ticks by which the arm follows late; this one a fault raises.
    """

    friction: float = inf
    force: float = inf
    strength: float = 1.0
    lag: int = 0


def physical(kind: Physical, source: Generator, world: World, scene: Scene, now: Hindrance) -> Iterator[None]:
    """The fault, one item a tick; `now` is the hindrance of the tick to come."""
    match kind:
        case Bump(thing, impulse, over, direction):
            way = _level(source) if direction is None else direction
            force = impulse / (over * TICK)
            push = (force * way[0], force * way[1], force * way[2])
            for _ in range(over):
                world.push(scene.thing(thing), push)
                yield
        case Slip(friction, lasts):
            for _ in range(lasts):
                now.friction = min(now.friction, friction)
                yield
        case Loosen(force, lasts):
            for _ in range(lasts):
                now.force = min(now.force, force)
                yield
        case Weaken(torque, lasts):
            for _ in range(lasts):
                now.strength = min(now.strength, torque)
                yield
        case Delay(by, lasts):
            for _ in range(lasts):
                now.lag = max(now.lag, by)
                yield


def seen(kind: Seen, source: Generator, found: Detected) -> Detected:
    """What comes of a picture's evaluation."""
    match kind:
        case Miss():
            return None
        case Misplace(by, direction):
            if found is None:
                return None
            way = _level(source) if direction is None else direction
            return (found[0] + by * way[0], found[1] + by * way[1], found[2] + by * way[2])


def _level(source: Generator) -> Triple:
    """A level direction, any."""
    angle = float(source.uniform(-pi, pi))
    return (cos(angle), sin(angle), 0.0)


class Hindered:
    """Brings a hindrance to the robot's motors and pads, and takes it back.

    The arm follows a queue of what was commanded.  After a delay it catches up at twice the pace, so that
    set points do not leap.
    """

    def __init__(self, world: World, robot: Panda) -> None:
        self._world = world
        self._robot = robot
        self._before = Hindrance()
        self._late: deque[tuple[Vector, Vector]] = deque()

    def apply(self, now: Hindrance) -> None:
        """Set motors and pads for the tick to come."""
        robot, before = self._robot, self._before
        if now.friction != before.friction:
            robot.set_finger_friction(min(now.friction, robot.finger_friction))
        if now.force != inf or before.force != inf:
            width, force = robot.grip_command
            robot.drive_fingers(width, min(force, now.force))
        if now.lag or self._late or now.strength != 1.0 or before.strength != 1.0:
            q, qd = self._followed(now.lag)
            robot.drive_arm(q, qd, now.strength)
        self._before = now

    def _followed(self, lag: int) -> tuple[Vector, Vector]:
        """The set points that the arm follows in this tick, `lag` ticks late or on the way there."""
        commanded = (self._robot.q_command, self._robot.qd_command)
        if lag and not self._late:
            # What the arm was told a tick ago and before is done: it waits there for what comes late.
            self._late.append((commanded[0] - commanded[1] * TICK, np.zeros(len(commanded[0]))))
        self._late.append(commanded)
        if len(self._late) > lag:
            for _ in range(min(2, len(self._late) - lag) - 1):
                self._late.popleft()
            return self._late.popleft()
        return self._late[0]

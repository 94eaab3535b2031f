"""External torques of the robot's joints: what its motors gave minus what the motion needed.

r ← r + α·(τ_ext − r), τ_ext = M(q)·q̈ + C(q, q̇)·q̇ + g(q) − τ, with the acceleration of the tick from the
joint speeds before and after it. It is the momentum observer ṙ = K·(τ_ext − r) in discrete time, α = 1 −
exp(−K·T). Source: S. Haddadin, A. De Luca, A. Albu-Schäffer, Robot Collisions: A Survey on Detection,
Isolation, and Identification, IEEE Transactions on Robotics 33 (2017), section IV.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import exp
from typing import Any, Final

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.clock import TICK

OBSERVER_GAIN: Final = 300.0
"""K, 1/s: a step of force is seen to 71 % in the next tick; chosen."""

_SHARE: Final = 1.0 - exp(-OBSERVER_GAIN * TICK)


class ExternalTorqueObserver:
    """Observer of the external torques of all movable joints.

    Args:
        world: the world.
        body: number of the robot.
        movable: numbers of its movable joints.
        applied: from the efforts that PyBullet reports of the motors of `movable`, N·m or N, those that they
            gave in the last tick.

    Attributes:
        torques: external torques, N·m, or forces, N, of the movable joints.
        positions: positions of the movable joints after the last tick, rad or m.
    """

    def __init__(
        self,
        world: PhysicsWorld,
        body: int,
        movable: tuple[int, ...],
        applied: Callable[[Sequence[float]], Sequence[float]],
    ) -> None:
        self._world = world
        self._body = body
        self._movable = movable
        self._applied = applied
        self._before: Any = ()
        self.torques: list[float] = [0.0] * len(movable)
        self.positions: Sequence[float] = self.torques
        self._given: list[Sequence[float]] = []
        world.before_step.append(self._note_start)
        world.after_substep.append(self._note_efforts)
        world.after_step.append(self._update)

    def _note_start(self) -> None:
        self._before = self._world.joint_states(self._body, self._movable)

    def _note_efforts(self) -> None:
        """Note the efforts of a step of the engine; PyBullet reports those of its last step alone."""
        corrections = [state[3] for state in self._world.joint_states(self._body, self._movable)]
        self._given.append(self._applied(corrections))

    def _update(self) -> None:
        q, before, _, _ = zip(*self._before, strict=True)
        self.positions, after, _, _ = zip(*self._world.joint_states(self._body, self._movable), strict=True)
        given, self._given = _means(self._given), []
        acceleration = [(b - a) / TICK for a, b in zip(before, after, strict=True)]
        needed = bullet.calculateInverseDynamics(
            self._body, q, before, acceleration, physicsClientId=self._world.client
        )
        self.torques = [
            seen + _SHARE * (need - motor - seen)
            for seen, need, motor in zip(self.torques, needed, given, strict=True)
        ]


def _means(rows: Sequence[Sequence[float]]) -> Sequence[float]:
    return rows[0] if len(rows) == 1 else [sum(column) / len(rows) for column in zip(*rows, strict=True)]

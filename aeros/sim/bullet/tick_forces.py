"""Forces and torques that act on bodies during one tick, in each step of the engine."""

from __future__ import annotations

from aeros.sim.bullet.client import bullet
from aeros.sim.geometry import Vector3


class TickForces:
    """Forces and torques of one tick. PyBullet forgets them after each of its steps.

    Args:
        client: number of the client.
    """

    def __init__(self, client: int) -> None:
        self._client = client
        self._pushes: list[tuple[int, int, Vector3]] = []
        self._turns: list[tuple[int, Vector3]] = []

    def push(self, body: int, force: Vector3, link: int = -1) -> None:
        """Push a body's base, or a link, at its centre of mass during the next tick.

        Args:
            body: number in PyBullet.
            force: in W, N.
            link: number of the link; -1 for the base.
        """
        self._pushes.append((body, link, force))

    def turn(self, body: int, torque: Vector3) -> None:
        """Turn a body's base during the next tick.

        Args:
            body: number in PyBullet.
            torque: in W, N·m.
        """
        self._turns.append((body, torque))

    def apply(self) -> None:
        """Apply them in the next step of the engine."""
        for body, link, force in self._pushes:
            if link < 0:
                place = bullet.getBasePositionAndOrientation(body, physicsClientId=self._client)[0]
            else:
                place = bullet.getLinkState(body, link, physicsClientId=self._client)[0]
            bullet.applyExternalForce(
                body, link, force, place, bullet.WORLD_FRAME, physicsClientId=self._client
            )
        for body, torque in self._turns:
            bullet.applyExternalTorque(body, -1, torque, bullet.WORLD_FRAME, physicsClientId=self._client)

    def clear(self) -> None:
        """Forget them at the end of the tick."""
        self._pushes.clear()
        self._turns.clear()

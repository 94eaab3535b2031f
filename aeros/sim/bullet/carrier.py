"""Somebody's hand that carries a body: forces that move it along a way, as a spring with a damper would.

The body is moved by forces and torques alone, so it pushes what stands in its way and is held by what holds
it.
"""

from __future__ import annotations

import numpy as np

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.carried_way import DAMPING, LIFT, MAX_FORCE, STIFFNESS, TURN_GAIN, CarriedWay
from aeros.sim.engine.world import GRAVITY
from aeros.sim.geometry import Vector3


class Carrier:
    """A hand that takes hold of a body where it is.

    Args:
        world: the simulated world.
        body: number of the body in PyBullet.
        goal: where the middle of its base is to be let go, in W, m.
        turn: angle by which it is turned on the way, rad.
        axis: axis of that turn in W, a unit vector.
        lift: height above the higher end of the way at which it is carried, m.
        strength: greatest force of the hand, N.
    """

    def __init__(
        self,
        world: PhysicsWorld,
        body: int,
        goal: Vector3,
        turn: float,
        axis: Vector3,
        *,
        lift: float = LIFT,
        strength: float = MAX_FORCE,
    ) -> None:
        self._world = world
        self._body = body
        self._way = CarriedWay(world.pose(body), goal, turn, axis, lift)
        joints = bullet.getNumJoints(body, physicsClientId=world.client)
        self._links = range(-1, joints)
        self._masses = [
            float(bullet.getDynamicsInfo(body, link, physicsClientId=world.client)[0]) for link in self._links
        ]
        self._strength = strength

    def push(self, share: float) -> None:
        """Push and turn the body during the next tick.

        Args:
            share: share of the time that has passed at its end, in (0, 1].
        """
        client, mass = self._world.client, sum(self._masses)
        place, orientation = self._world.pose(self._body)
        speed, spin = bullet.getBaseVelocity(self._body, physicsClientId=client)
        wanted = np.array(self._way.position(share))
        pull = STIFFNESS * (wanted - np.array(place)) - DAMPING * np.array(speed)
        pull[2] += GRAVITY
        force_wanted = float(np.linalg.norm(pull)) * mass
        pull *= min(1.0, self._strength / force_wanted) if force_wanted > 0.0 else 1.0
        for link, part in zip(self._links, self._masses, strict=True):
            if part > 0.0:
                x, y, z = (part * pull).tolist()
                self._world.forces.push(self._body, (x, y, z), link)
        error = bullet.getAxisAngleFromQuaternion(
            bullet.getDifferenceQuaternion(orientation, self._way.orientation(share))
        )
        angle = error[1] if error[1] <= np.pi else error[1] - 2.0 * np.pi
        gain = TURN_GAIN * mass / 0.1
        x, y, z = (gain * angle * np.array(error[0]) - 0.1 * gain * np.array(spin)).tolist()
        self._world.forces.turn(self._body, (x, y, z))


def is_occupied(world: PhysicsWorld, low: Vector3, high: Vector3, body: int) -> bool:
    """Check if the bounds of some link of a body overlap with a box.

    Args:
        world: the simulated world.
        low: lowest corner of the box in W, m.
        high: highest corner in W, m.
        body: number of the body in PyBullet.

    Returns:
        True if they do.
    """
    links = range(-1, bullet.getNumJoints(body, physicsClientId=world.client))
    bounds = (bullet.getAABB(body, link, physicsClientId=world.client) for link in links)
    return any(
        all(a < d and c < b for a, b, c, d in zip(lower, upper, low, high, strict=True))
        for lower, upper in bounds
    )

"""Somebody's hand that carries a body: forces that move it along a way, as a spring with a damper would."""

from __future__ import annotations

from math import acos

import numpy as np

from aeros.sim.engine.carried_way import DAMPING, STIFFNESS, TURN_GAIN, CarriedWay
from aeros.sim.engine.world import GRAVITY
from aeros.sim.geometry import Pose, Quaternion, Vector3, compose
from aeros.sim.mujoco.world import MujocoWorld
from aeros.sim.pictures.solids import Array


class MujocoCarrier:
    """A hand that takes hold of a body where it is. It implements `CarryingHand`.

    Args:
        world: the simulated world.
        body: number of the body.
        goal: where the middle of its base is to be let go, in W, m.
        turn: angle by which it is turned on the way, rad.
        axis: axis of that turn in W, a unit vector.
        lift: height above the higher end of the way at which it is carried, m.
        strength: greatest force of the hand, N.
    """

    def __init__(
        self,
        world: MujocoWorld,
        body: int,
        goal: Vector3,
        turn: float,
        axis: Vector3,
        *,
        lift: float,
        strength: float,
    ) -> None:
        self._world = world
        self._body = body
        self._way = CarriedWay(world.pose(body), goal, turn, axis, lift)
        self._strength = strength
        links = world.bodies.bodies[body]
        self._masses = [0.0 if link.inertia is None else link.inertia.mass for link in links]

    def push(self, share: float) -> None:
        """Implement `CarryingHand.push`: every link is drawn in proportion to its mass."""
        built, mass = self._world.bodies.built(), sum(self._masses)
        place, orientation = self._world.pose(self._body)
        speed, spin = self._world.velocity(self._body)
        wanted = np.array(self._way.position(share))
        pull = STIFFNESS * (wanted - np.array(place)) - DAMPING * speed
        pull[2] += GRAVITY
        force_wanted = float(np.linalg.norm(pull)) * mass
        pull *= min(1.0, self._strength / force_wanted) if force_wanted > 0.0 else 1.0
        for link, part in enumerate(self._masses, -1):
            built.data.xfrc_applied[built.links[self._body, link], :3] += part * pull
        gain = TURN_GAIN * mass / 0.1
        torque = gain * _turn_between(orientation, self._way.orientation(share)) - 0.1 * gain * spin
        built.data.xfrc_applied[built.links[self._body, -1], 3:] += torque


def _turn_between(start: Quaternion, end: Quaternion) -> Array:
    """Return the turn from one orientation to another about its axis in W (3,), rad, by the shorter way."""
    x, y, z, w = start
    origin = (0.0, 0.0, 0.0)
    a, b, c, d = compose(Pose(origin, end), Pose(origin, (-x, -y, -z, w))).orientation
    sign = -1.0 if d < 0.0 else 1.0
    half = np.array((a, b, c)) * sign
    length = float(np.linalg.norm(half))
    turn: Array = half * (2.0 * acos(min(1.0, abs(d))) / length) if length > 0.0 else half
    return turn

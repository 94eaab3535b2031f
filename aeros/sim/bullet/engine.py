"""PyBullet as engine of the physics plant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import Final

from aeros.sim.bullet.bodies import add_body
from aeros.sim.bullet.carrier import Carrier, is_occupied
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.cut_bodies import CutBodies
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.engine import PlacedBody
from aeros.sim.engine.world import PERSON_COLOUR, Rgba
from aeros.sim.geometry import UPRIGHT, Pose, Vector3
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions
from aeros.spec.model.scene import SceneBody

_PICTURE_HEIGHT: Final = 0.0005
"""Height of a painted picture over the surface that it is on, m."""

_DISTANCE_STEP: Final = 0.02
"""Margin over the previous distance for the first query, m: robot and person closing in at 4.8 m/s."""


class BulletEngine:
    """A PyBullet client. It implements `Engine`.

    Args:
        world: the world; a new one by default.

    Attributes:
        world: the world.
    """

    def __init__(self, world: PhysicsWorld | None = None) -> None:
        self.world = PhysicsWorld() if world is None else world

    def add_robot(self, options: RobotOptions, odometry: WheelOdometry) -> BulletRobot:
        """Implement `Engine.add_robot`."""
        return BulletRobot(self.world, options, odometry)

    def add_body(self, body: SceneBody, pose: Pose) -> PlacedBody:
        """Implement `Engine.add_body`."""
        return add_body(self.world, body, pose)

    def add_box(self, edges: Vector3, position: Vector3, *, mass: float, colour: Rgba) -> int:
        """Implement `Engine.add_box`."""
        return self.world.bodies.add_box(edges, position, mass=mass, colour=colour)

    def add_painted_rectangle(
        self, low: tuple[float, float], high: tuple[float, float], surface: float
    ) -> int:
        """Implement `Engine.add_painted_rectangle`."""
        return self.world.bodies.add_textured_rectangle(low, high, surface + _PICTURE_HEIGHT)

    def add_person(self, height: float, radius: float) -> BulletPerson:
        """Implement `Engine.add_person`."""
        return BulletPerson(self.world.client, height, radius)

    def set_joint_friction(self, body: int, joint: int, friction: float) -> None:
        """Implement `Engine.set_joint_friction`."""
        self.world.bodies.set_joint_friction(body, joint, friction)

    def carry(
        self, body: int, goal: Vector3, turn: float, axis: Vector3, *, lift: float, strength: float
    ) -> Carrier:
        """Implement `Engine.carry`."""
        return Carrier(self.world, body, goal, turn, axis, lift=lift, strength=strength)

    def is_occupied(self, low: Vector3, high: Vector3, body: int) -> bool:
        """Implement `Engine.is_occupied`."""
        return is_occupied(self.world, low, high, body)

    def cut_bodies(self, height: float, left_out: Callable[[], Sequence[int]]) -> CutBodies:
        """Implement `Engine.cut_bodies`."""
        return CutBodies(self.world, height, left_out)


class BulletPerson:
    """The capsule of a person in a PyBullet client. It implements `PersonBody`.

    Args:
        client: number of the client.
        height: of the capsule, m.
        radius: of the capsule, m.

    Attributes:
        number: number of its body.
    """

    def __init__(self, client: int, height: float, radius: float) -> None:
        self._client = client
        self._last = inf
        length = height - 2.0 * radius
        shape = bullet.createCollisionShape(
            bullet.GEOM_CAPSULE, radius=radius, height=length, physicsClientId=client
        )
        visual = bullet.createVisualShape(
            bullet.GEOM_CAPSULE,
            radius=radius,
            length=length,
            rgbaColor=PERSON_COLOUR,
            physicsClientId=client,
        )
        self.number: int = bullet.createMultiBody(0.0, shape, visual, physicsClientId=client)
        bullet.setCollisionFilterGroupMask(self.number, -1, 0, 0, physicsClientId=client)

    def move(self, position: Vector3) -> None:
        """Implement `PersonBody.move`."""
        bullet.resetBasePositionAndOrientation(self.number, position, UPRIGHT, physicsClientId=self._client)

    def distance(self, robot: int, within: float) -> float:
        """Implement `PersonBody.distance`, first with a range just above the previous distance.

        Most links are out of that range, and a query with the full range would cost more than everything
        else.
        """
        near = self._query_distance(robot, min(within, self._last + _DISTANCE_STEP))
        self._last = near if near < inf else self._query_distance(robot, within)
        return self._last

    def _query_distance(self, robot: int, within: float) -> float:
        points = bullet.getClosestPoints(robot, self.number, within, physicsClientId=self._client)
        return min((float(point[8]) for point in points), default=inf)

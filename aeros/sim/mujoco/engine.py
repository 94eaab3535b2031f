"""MuJoCo as engine of the physics plant."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from aeros.sim.engine.engine import PlacedBody
from aeros.sim.engine.world import Rgba
from aeros.sim.geometry import UPRIGHT, Pose, Vector3
from aeros.sim.mujoco.carrier import MujocoCarrier
from aeros.sim.mujoco.cut_bodies import MujocoCutPlane, bounds_of
from aeros.sim.mujoco.pictures import person_solids
from aeros.sim.mujoco.plans import (
    AT_ORIGIN,
    Friction,
    LinkPlan,
    ShapePlan,
    inertia_of_shapes,
    names_of_joints,
    names_of_links,
)
from aeros.sim.mujoco.robot import MujocoRobot
from aeros.sim.mujoco.scene_plans import plan_body
from aeros.sim.mujoco.world import MujocoWorld
from aeros.sim.pictures.solids import box
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions
from aeros.spec.model.scene import SceneBody

_BOX_FRICTION = Friction(0.6)


class MujocoEngine:
    """A MuJoCo world. It implements `Engine`.

    Attributes:
        world: the world.
    """

    def __init__(self) -> None:
        self.world = MujocoWorld()

    def add_robot(self, options: RobotOptions, odometry: WheelOdometry) -> MujocoRobot:
        """Implement `Engine.add_robot`."""
        return MujocoRobot(self.world, options, odometry)

    def add_body(self, body: SceneBody, pose: Pose) -> PlacedBody:
        """Implement `Engine.add_body`."""
        links = plan_body(body)
        number = self.world.bodies.add(links, pose, moves=body.is_movable)
        return PlacedBody(body, number, names_of_links(links), names_of_joints(links))

    def add_box(self, edges: Vector3, position: Vector3, *, mass: float, colour: Rgba) -> int:
        """Implement `Engine.add_box`."""
        shape = ShapePlan("box", edges)
        inertia = inertia_of_shapes(mass, (shape,)) if mass > 0.0 else None
        visuals = (box(edges, colour[:3]),)
        link = LinkPlan("box", None, AT_ORIGIN, None, inertia, (shape,), _BOX_FRICTION, visuals)
        return self.world.bodies.add((link,), Pose(position, UPRIGHT), moves=mass > 0.0)

    def add_painted_rectangle(
        self, low: tuple[float, float], high: tuple[float, float], surface: float
    ) -> int:
        """Implement `Engine.add_painted_rectangle`."""
        return self.world.renderer.add_rectangle(low, high, surface)

    def add_person(self, height: float, radius: float) -> MujocoPerson:
        """Implement `Engine.add_person`."""
        return MujocoPerson(self.world, height, radius)

    def set_joint_friction(self, body: int, joint: int, friction: float) -> None:
        """Implement `Engine.set_joint_friction`."""
        self.world.bodies.set_joint_friction(body, joint, friction)

    def carry(
        self, body: int, goal: Vector3, turn: float, axis: Vector3, *, lift: float, strength: float
    ) -> MujocoCarrier:
        """Implement `Engine.carry`."""
        return MujocoCarrier(self.world, body, goal, turn, axis, lift=lift, strength=strength)

    def is_occupied(self, low: Vector3, high: Vector3, body: int) -> bool:
        """Implement `Engine.is_occupied`."""
        built = self.world.bodies.built()
        lowest, highest = bounds_of(built)
        meets = ((lowest < high) & (low < highest)).all(axis=1)
        return bool(np.any(meets & (built.owners[:, 0] == body)))

    def cut_bodies(self, height: float, left_out: Callable[[], Sequence[int]]) -> MujocoCutPlane:
        """Implement `Engine.cut_bodies`."""
        return MujocoCutPlane(self.world, height, left_out)


class MujocoPerson:
    """The capsule of a person in a MuJoCo world. It implements `PersonBody`.

    Args:
        world: the world.
        height: of the capsule, m.
        radius: of the capsule, m.

    Attributes:
        number: number of its body.
    """

    def __init__(self, world: MujocoWorld, height: float, radius: float) -> None:
        self._world = world
        capsule = ShapePlan("capsule", (radius, height - 2.0 * radius, 0.0))
        self.number = world.bodies.add_moved(capsule, person_solids(capsule))

    def move(self, position: Vector3) -> None:
        """Implement `PersonBody.move`."""
        self._world.bodies.move(self.number, position)

    def distance(self, robot: int, within: float) -> float:
        """Implement `PersonBody.distance`."""
        return self._world.distance(robot, self.number, within)

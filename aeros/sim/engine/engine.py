"""The port of a physics engine: adds robot, bodies and people to one world, and cuts and carries them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.engine.world import EngineWorld, Rgba
from aeros.sim.geometry import Pose, Vector3
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.scanners.sections import Section
from aeros.spec.model.scene import SceneBody


class PlacedBody(NamedTuple):
    """A body of a scene in a world.

    Attributes:
        body: the declaration.
        number: number of the body.
        links: numbers of its links by name; -1 is the base.
        joints: numbers of its movable joints by name.
    """

    body: SceneBody
    number: int
    links: Mapping[str, int]
    joints: Mapping[str, int]


class CarryingHand(Protocol):
    """Somebody's hand that carries a body by forces."""

    def push(self, share: float) -> None:
        """Push and turn the body in the next step.

        Args:
            share: share of the time that has passed at its end, in (0, 1].
        """


class PersonBody(Protocol):
    """The capsule of a person: it is moved, and touches nothing."""

    @property
    def number(self) -> int:
        """Number of the body."""

    def move(self, position: Vector3) -> None:
        """Put it at a place.

        Args:
            position: of its middle in W, m.
        """

    def distance(self, robot: int, within: float) -> float:
        """Measure the distance from a robot.

        Args:
            robot: number of the robot.
            within: range of the measurement, m.

        Returns:
            The distance, m; negative if they overlap, inf if it is out of the range.
        """


class CutPlane(Protocol):
    """A level plane that cuts the bodies of a world."""

    def sections(self) -> Sequence[Section]:
        """Cut the bodies where they are now.

        Returns:
            The sections; the same object as long as nothing has moved.
        """


class Engine(Protocol):
    """A physics engine with a world of its own."""

    @property
    def world(self) -> EngineWorld:
        """The world."""

    def add_robot(self, options: RobotOptions, odometry: WheelOdometry) -> PhysicalRobot:
        """Add the robot, before everything else.

        Args:
            options: carriage, base position, initial posture and friction.
            odometry: of the carriage.

        Returns:
            The robot, at rest.
        """

    def add_body(self, body: SceneBody, pose: Pose) -> PlacedBody:
        """Add a body of a scene.

        Args:
            body: the body.
            pose: of its frame in W.

        Returns:
            The body in the world.

        Raises:
            UserError: its URDF file cannot be loaded.
        """

    def add_box(self, edges: Vector3, position: Vector3, *, mass: float, colour: Rgba) -> int:
        """Add a box whose edges are along the axes of W.

        Args:
            edges: full lengths, m.
            position: of its middle in W, m.
            mass: kg; 0 fixes it to W.
            colour: its colour.

        Returns:
            Its number.
        """

    def add_painted_rectangle(
        self, low: tuple[float, float], high: tuple[float, float], surface: float
    ) -> int:
        """Add a picture on a level surface that is visible and has no contacts.

        Args:
            low: corner with the least x and y in W, m.
            high: corner with the greatest x and y in W, m.
            surface: height of the surface in W, m.

        Returns:
            Its number; `EngineRenderer.paint` sets its picture.
        """

    def add_person(self, height: float, radius: float) -> PersonBody:
        """Add the capsule of a person.

        Args:
            height: of the capsule, m.
            radius: of the capsule, m.

        Returns:
            The capsule, at the origin of W.
        """

    def set_joint_friction(self, body: int, joint: int, friction: float) -> None:
        """Set the dry friction of a joint.

        Args:
            body: number of its body.
            joint: number of the joint.
            friction: N·m or N.
        """

    def carry(
        self, body: int, goal: Vector3, turn: float, axis: Vector3, *, lift: float, strength: float
    ) -> CarryingHand:
        """Take hold of a body where it is.

        Args:
            body: its number.
            goal: where the middle of its base is to be let go, in W, m.
            turn: angle by which it is turned on the way, rad.
            axis: axis of that turn in W, a unit vector.
            lift: height above the higher end of the way at which it is carried, m.
            strength: greatest force of the hand, N.

        Returns:
            The hand.
        """

    def is_occupied(self, low: Vector3, high: Vector3, body: int) -> bool:
        """Check if the bounds of some link of a body overlap with a box.

        Args:
            low: lowest corner of the box in W, m.
            high: highest corner in W, m.
            body: number of the body.

        Returns:
            True if they do.
        """

    def cut_bodies(self, height: float, left_out: Callable[[], Sequence[int]]) -> CutPlane:
        """Cut all bodies but some with a level plane.

        Args:
            height: of the plane in W, m.
            left_out: says which bodies do not count, by their numbers.

        Returns:
            The plane.
        """

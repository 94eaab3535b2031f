"""Solids of a scene: its bodies with their links, its coatings, and the robot."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from math import hypot
from typing import Final, Protocol

import numpy as np

from aeros.kinematic_chain import frames_of
from aeros.sim.geometry import UPRIGHT, Pose, Vector3, add, compose
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.pictures.ray_caster import Decal, PlacedSolid, place
from aeros.sim.pictures.solids import Solid, hull, solids_of_shape
from aeros.sim.pictures.urdf_model import UrdfVisuals
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import CARRIAGE_EDGES
from aeros.spec.model.scene import BodyPart, Box, Scene, UrdfModel

_ROBOT_COLOUR: Final = (0.9, 0.9, 0.9)
_CARRIAGE_COLOUR: Final = (1.0, 1.0, 1.0)


class PosedBodies(Protocol):
    """The poses of the bodies of a scene."""

    def pose_of(self, part: BodyPart) -> Pose:
        """Read the pose of a body.

        Args:
            part: the body.

        Returns:
            The pose of its frame in W.
        """

    def joint_position(self, joint: BodyPart) -> float:
        """Read the position of a joint.

        Args:
            joint: the joint.

        Returns:
            The position, rad or m.
        """


class SceneSolids:
    """The solids of a scene's bodies.

    Args:
        scene: the scene.

    Attributes:
        reach: distance from each body's frame within which all of it is, by the body's name, m.
    """

    def __init__(self, scene: Scene) -> None:
        self._models = {
            name: (body.shape, UrdfVisuals(body.shape.path))
            for name, body in scene.bodies.items()
            if isinstance(body.shape, UrdfModel)
        }
        self._rigid = {
            name: tuple(solids_of_shape(body.shape, body.colour))
            for name, body in scene.bodies.items()
            if not isinstance(body.shape, UrdfModel)
        }
        self.reach = {name: max(map(_reach, solids), default=0.0) for name, solids in self._rigid.items()}
        for name, (_, visuals) in self._models.items():
            parts = [
                _reach(solid) + hypot(*visuals.link_pose(link, {}).position) for link, solid in visuals.solids
            ]
            # However its joints are turned: a part is no farther away than all lengths to it together.
            self.reach[name] = 2.0 * max(parts, default=0.0)

    def placed(self, world: PosedBodies, names: Collection[str] | None = None) -> Iterator[PlacedSolid]:
        """Yield every solid where it is now.

        Args:
            world: says where the bodies are.
            names: of the bodies; None for all.

        Yields:
            The solids.
        """
        for name, solids in self._rigid.items():
            if names is not None and name not in names:
                continue
            pose = world.pose_of(BodyPart(name))
            yield from (place(solid, pose) for solid in solids)
        for name, (model, visuals) in self._models.items():
            if names is not None and name not in names:
                continue
            pose = world.pose_of(BodyPart(name))
            positions = {joint: world.joint_position(BodyPart(name, joint)) for joint in model.joints}
            for link, solid in visuals.solids:
                yield place(solid, compose(pose, visuals.link_pose(link, positions)))


def _reach(solid: Solid) -> float:
    """Return the distance from the frame that a solid is in within which all of it is, m."""
    return hypot(*solid.place.position) + solid.radius


def decals_of(coatings: Mapping[str, CoatingMap]) -> tuple[Decal, ...]:
    """Show coatings as they are now.

    Args:
        coatings: the coatings by name.

    Returns:
        A picture of each, on the top of what it covers.
    """
    return tuple(Decal(one.coating.low, one.coating.high, 0.0, one.picture()) for one in coatings.values())


def robot_solids(arm: RobotModel, joints: Sequence[float], base: Vector3) -> Iterator[PlacedSolid]:
    """Yield the links of the robot.

    Args:
        arm: the robot.
        joints: joint positions, rad.
        base: position of the arm's base in W, m; its axes are those of W.

    Yields:
        The hulls of its links.
    """
    frames = frames_of(arm.mountings, joints)
    for joint, solid in _hulls(arm):
        frame = frames[joint]
        middle = add(base, frame.to_base(solid.place.position))
        yield PlacedSolid(solid, middle, np.array((frame.x, frame.y, frame.z)).T)


def carriage_solid(base: Vector3) -> PlacedSolid:
    """Place the carriage that the robot drives on.

    Args:
        base: position of the arm's base in W, m.

    Returns:
        Its box.
    """
    (box,) = solids_of_shape(Box(CARRIAGE_EDGES), _CARRIAGE_COLOUR)
    return place(box, Pose(add(base, (0.0, 0.0, -CARRIAGE_EDGES[2] / 2.0)), UPRIGHT))


@cache
def _hulls(arm: RobotModel) -> tuple[tuple[int, Solid], ...]:
    return tuple((one.joint, hull(one.corners, _ROBOT_COLOUR)) for one in arm.body.hulls)

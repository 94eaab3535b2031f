"""Bodies of a PyBullet client: rigid parts, URDF files and painted rectangles, and their friction."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import NamedTuple

from aeros.sim.bullet.client import bullet
from aeros.sim.engine.world import Rgba
from aeros.sim.geometry import UPRIGHT, Quaternion, Vector3
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError


class RigidPart(NamedTuple):
    """A part of a rigid body.

    Attributes:
        kind: `GEOM_BOX`, `GEOM_CYLINDER` or `GEOM_SPHERE` of PyBullet.
        size: full lengths of a box; radius and height of a cylinder, then 0; radius of a sphere, then 0, m.
        position: of its middle in the body's frame, m.
        colour: red, green, blue and alpha in [0, 1].
    """

    kind: int
    size: Vector3
    position: Vector3
    colour: Rgba


def load_model(
    path: str,
    position: Vector3,
    orientation: Quaternion = UPRIGHT,
    *,
    fixed: bool,
    client: int,
    collides_with_itself: bool = False,
    declared_inertia: bool = False,
) -> int:
    """Load a URDF file as a body.

    Args:
        path: of the file.
        position: of its frame in W, m.
        orientation: of its frame in W.
        fixed: fix its base to W.
        client: number of the PyBullet client.
        collides_with_itself: let its links collide with each other.
        declared_inertia: take inertias of links from the file; otherwise PyBullet computes them of shapes.

    Returns:
        The body's number in PyBullet.

    Raises:
        UserError: there is no such file, or PyBullet cannot load it.
    """
    if not os.path.isfile(path):
        missing = f"model file not found: `{path}`"
        raise UserError([Diagnostic("AE002", missing, help=("install AEROS again if it came with it",))])
    flags = bullet.URDF_USE_SELF_COLLISION if collides_with_itself else 0
    flags |= bullet.URDF_USE_INERTIA_FROM_FILE if declared_inertia else 0
    try:
        body: int = bullet.loadURDF(
            path,
            position,
            orientation,
            useFixedBase=fixed,
            flags=flags,
            physicsClientId=client,
        )
    except bullet.error as error:
        raise UserError([Diagnostic("AE141", f"PyBullet cannot load `{path}`: {error}")]) from error
    return body


class BodyFactory:
    """Adds bodies to one PyBullet client, and sets their friction.

    Args:
        client: number of the client.
    """

    def __init__(self, client: int) -> None:
        self.client = client

    def add_box(
        self,
        size: Vector3,
        position: Vector3,
        orientation: Quaternion = UPRIGHT,
        *,
        mass: float = 0.0,
        colour: Rgba = (0.7, 0.7, 0.7, 1.0),
        friction: float = 0.6,
    ) -> int:
        """Add a box.

        Args:
            size: full lengths of its edges, m.
            position: of its middle in W, m.
            orientation: in W.
            mass: kg; 0 fixes it to W.
            colour: red, green, blue and alpha in [0, 1].
            friction: Coulomb coefficient.

        Returns:
            The body's number in PyBullet.
        """
        half = [edge / 2.0 for edge in size]
        shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=half, physicsClientId=self.client)
        visual = bullet.createVisualShape(
            bullet.GEOM_BOX, halfExtents=half, rgbaColor=colour, physicsClientId=self.client
        )
        return self._add(shape, visual, mass, position, orientation, friction)

    def add_cylinder(
        self,
        radius: float,
        height: float,
        position: Vector3,
        orientation: Quaternion = UPRIGHT,
        *,
        mass: float = 0.0,
        colour: Rgba = (0.7, 0.7, 0.7, 1.0),
        friction: float = 0.6,
    ) -> int:
        """Add a cylinder about its own z axis.

        Args:
            radius: m.
            height: m.
            position: of its middle in W, m.
            orientation: in W.
            mass: kg; 0 fixes it to W.
            colour: red, green, blue and alpha in [0, 1].
            friction: Coulomb coefficient.

        Returns:
            The body's number in PyBullet.
        """
        shape = bullet.createCollisionShape(
            bullet.GEOM_CYLINDER, radius=radius, height=height, physicsClientId=self.client
        )
        visual = bullet.createVisualShape(
            bullet.GEOM_CYLINDER, radius=radius, length=height, rgbaColor=colour, physicsClientId=self.client
        )
        return self._add(shape, visual, mass, position, orientation, friction)

    def add_parts(
        self,
        parts: Sequence[RigidPart],
        position: Vector3,
        orientation: Quaternion = UPRIGHT,
        *,
        mass: float = 0.0,
        friction: float = 0.6,
    ) -> int:
        """Add a rigid body of several parts; its centre of mass is the origin of its frame.

        Args:
            parts: the parts.
            position: of its frame in W, m.
            orientation: in W.
            mass: kg; 0 fixes it to W.
            friction: Coulomb coefficient.

        Returns:
            The body's number in PyBullet.
        """
        sizes = {
            "shapeTypes": [part.kind for part in parts],
            "halfExtents": [[edge / 2.0 for edge in part.size] for part in parts],
            "radii": [part.size[0] for part in parts],
            "lengths": [part.size[1] for part in parts],
            "physicsClientId": self.client,
        }
        places = [part.position for part in parts]
        shape = bullet.createCollisionShapeArray(**sizes, collisionFramePositions=places)
        visual = bullet.createVisualShapeArray(
            **sizes, visualFramePositions=places, rgbaColors=[part.colour for part in parts]
        )
        return self._add(shape, visual, mass, position, orientation, friction)

    def _add(
        self,
        shape: int,
        visual: int,
        mass: float,
        position: Vector3,
        orientation: Quaternion,
        friction: float,
    ) -> int:
        body: int = bullet.createMultiBody(
            mass, shape, visual, position, orientation, physicsClientId=self.client
        )
        self.set_friction(body, -1, friction)
        return body

    def add_textured_rectangle(
        self, low: tuple[float, float], high: tuple[float, float], height: float
    ) -> int:
        """Add a horizontal rectangle that is visible but has no contacts; `Renderer.paint` sets its picture.

        Args:
            low: corner with the least x and y in W, m.
            high: corner with the greatest x and y in W, m.
            height: z in W, m.

        Returns:
            The body's number in PyBullet.
        """
        (a, b), (c, d) = low, high
        visual = bullet.createVisualShape(
            bullet.GEOM_MESH,
            vertices=[(a, b, height), (c, b, height), (c, d, height), (a, d, height)],
            indices=[0, 1, 2, 0, 2, 3],
            uvs=[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
            normals=[(0.0, 0.0, 1.0)] * 4,
            rgbaColor=(1.0, 1.0, 1.0, 1.0),
            physicsClientId=self.client,
        )
        body: int = bullet.createMultiBody(0.0, -1, visual, physicsClientId=self.client)
        return body

    def add_urdf(
        self,
        path: str,
        position: Vector3,
        orientation: Quaternion = UPRIGHT,
        *,
        fixed: bool = False,
        friction: float = 0.6,
    ) -> int:
        """Add a body from a URDF file.

        Args:
            path: of the file.
            position: of its frame in W, m.
            orientation: in W.
            fixed: fix its base to W.
            friction: Coulomb coefficient of every link.

        Returns:
            The body's number in PyBullet.

        Raises:
            UserError: there is no such file, or PyBullet cannot load it.
        """
        body = load_model(path, position, orientation, fixed=fixed, client=self.client, declared_inertia=True)
        for link in range(-1, bullet.getNumJoints(body, physicsClientId=self.client)):
            self.set_friction(body, link, friction)
        return body

    def set_friction(self, body: int, link: int, lateral: float, spinning: float = 0.02) -> None:
        """Set the friction of a link; Bullet multiplies the coefficients of the two touching bodies.

        Args:
            body: number in PyBullet.
            link: number of the link; -1 for the base.
            lateral: Coulomb coefficient.
            spinning: coefficient about the contact normal. Without 0.02, gripped cylinders turn in the
                fingers (47 of 100 picks).
        """
        bullet.changeDynamics(
            body,
            link,
            lateralFriction=lateral,
            spinningFriction=spinning,
            frictionAnchor=0,
            physicsClientId=self.client,
        )

    def set_rolling_resistance(self, body: int, lever: float) -> None:
        """Make a body lose speed as it rolls.

        The braking torque is the normal force times `lever`; `lever` over the radius is the coefficient of
        rolling resistance. Bullet multiplies it by the other body's friction.

        Args:
            body: number in PyBullet.
            lever: m.
        """
        bullet.changeDynamics(body, -1, rollingFriction=lever, physicsClientId=self.client)

    def set_joint_friction(self, body: int, joint: int, torque: float) -> None:
        """Give a joint dry friction: a motor that resists motion with at most a given torque.

        Args:
            body: number in PyBullet.
            joint: number of the joint.
            torque: N·m.
        """
        bullet.setJointMotorControl2(
            body,
            joint,
            bullet.VELOCITY_CONTROL,
            targetVelocity=0.0,
            force=torque,
            physicsClientId=self.client,
        )

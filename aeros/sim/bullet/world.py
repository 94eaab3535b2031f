"""One PyBullet world: stepping, bodies, contacts and pictures.

Frame W: origin on the table top (or floor) under the arm's base, z up. SI units; quaternions x, y, z, w.
Settings (measured on a prototype): 240 Hz and 50 solver iterations; fewer of either lose grasps.
`deterministicOverlappingPairs` makes a rebuilt world repeat bit for bit.
"""

from __future__ import annotations

import math
import os
import tempfile
from itertools import combinations
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from aeros.sim.bullet.client import bullet
from aeros.sim.clock import TICK
from aeros.sim.geometry import UPRIGHT, Camera, Pose, Quaternion, Vector3
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError

Colour = tuple[float, float, float, float]

GRAVITY: Final = 9.81
"""Standard acceleration, m/s², rounded as PyBullet's examples do."""


def load_model(
    path: str, position: Vector3, orientation: Quaternion = UPRIGHT, *, fixed: bool, client: int
) -> int:
    """Load a URDF file as a body.

    Args:
        path: of the file.
        position: of its frame in W, m.
        orientation: of its frame in W.
        fixed: fix its base to W.
        client: number of the PyBullet client.

    Returns:
        The body's number in PyBullet.

    Raises:
        UserError: there is no such file, or PyBullet cannot load it.
    """
    if not os.path.isfile(path):
        missing = f"model file not found: `{path}`"
        raise UserError([Diagnostic("AE002", missing, help=("install AEROS again if it came with it",))])
    try:
        body: int = bullet.loadURDF(path, position, orientation, useFixedBase=fixed, physicsClientId=client)
    except bullet.error as error:
        raise UserError([Diagnostic("AE141", f"PyBullet cannot load `{path}`: {error}")]) from error
    return body


class Contact(NamedTuple):
    """A contact point of a first body with a second.

    Attributes:
        link_a: number of the first body's link.
        link_b: number of the second body's link.
        body_b: number of the second body.
        position: in W, m.
        normal: unit vector in W, towards the first body.
        force: normal force, N.
    """

    link_a: int
    link_b: int
    body_b: int
    position: Vector3
    normal: Vector3
    force: float


class Image(NamedTuple):
    """A rendered picture.

    Attributes:
        rgb: (height, width, 3), 0 to 255.
        depth: along the optical axis (height, width), m.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float64]


class PhysicsWorld:
    """A PyBullet client of its own; worlds share nothing.

    Attributes:
        client: number of the client; -1 once closed.
        ticks: number of steps since the clock was set to 0.
    """

    def __init__(self) -> None:
        self.client: int = bullet.connect(bullet.DIRECT)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=TICK,
            numSolverIterations=50,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        bullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
        self.ticks = 0
        # Contact points by body after the last step, cached on first query.
        self._touching: dict[int, Any] = {}
        # Pictures to apply at the next rendering: a sponge changes one at every tick.
        self._unpainted: dict[int, NDArray[np.uint8]] = {}

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.ticks * TICK

    def step(self) -> None:
        """Advance by one tick."""
        bullet.stepSimulation(physicsClientId=self.client)
        self._touching.clear()
        self.ticks += 1

    def close(self) -> None:
        """End the client; safe to call twice."""
        if self.client >= 0:
            bullet.disconnect(physicsClientId=self.client)
            self.client = -1

    # Bodies.

    def add_box(
        self,
        size: Vector3,
        position: Vector3,
        orientation: Quaternion = UPRIGHT,
        *,
        mass: float = 0.0,
        colour: Colour = (0.7, 0.7, 0.7, 1.0),
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
        colour: Colour = (0.7, 0.7, 0.7, 1.0),
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
        """Add a horizontal rectangle that is visible but has no contacts; `paint` sets its picture.

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

    def paint(self, body: int, rgb: NDArray[np.uint8]) -> None:
        """Set the picture of a rectangle; it is applied when the next picture is rendered.

        Args:
            body: of `add_textured_rectangle`.
            rgb: (rows, columns, 3), 0 to 255; rows from the least y, columns from the least x.
        """
        self._unpainted[body] = rgb

    def _paint(self, body: int, rgb: NDArray[np.uint8]) -> None:
        """Apply a picture to a rectangle.

        The TinyRenderer does not notice a change of a texture that it has, and Bullet reads each file name
        only once, so every change is a new texture from a new file.
        """
        with tempfile.TemporaryDirectory() as scratch:
            path = Path(scratch, "paint.bmp")
            Picture.fromarray(np.ascontiguousarray(rgb[::-1])).save(path)
            texture = bullet.loadTexture(str(path), physicsClientId=self.client)
        bullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=self.client)

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
        body = load_model(path, position, orientation, fixed=fixed, client=self.client)
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

    def push(self, body: int, force: Vector3) -> None:
        """Push a body's base at its centre of mass in the next step.

        Args:
            body: number in PyBullet.
            force: in W, N.
        """
        place, _ = self.pose(body)
        bullet.applyExternalForce(body, -1, force, place, bullet.WORLD_FRAME, physicsClientId=self.client)

    # Measurements.

    def pose(self, body: int, link: int = -1) -> Pose:
        """Read the pose of a body's base, or of a link's frame.

        Args:
            body: number in PyBullet.
            link: number of the link; -1 for the base, whose pose is that of its centre of mass.

        Returns:
            The pose in W.
        """
        if link < 0:
            return Pose(*bullet.getBasePositionAndOrientation(body, physicsClientId=self.client))
        state = bullet.getLinkState(body, link, computeForwardKinematics=1, physicsClientId=self.client)
        return Pose(state[4], state[5])

    def joint_position(self, body: int, joint: int) -> float:
        """Read the position of a joint.

        Args:
            body: number in PyBullet.
            joint: number of the joint.

        Returns:
            The position, rad or m.
        """
        position: float = bullet.getJointState(body, joint, physicsClientId=self.client)[0]
        return position

    def contacts(self, body: int, other: int | None = None, link: int | None = None) -> list[Contact]:
        """List the contact points of a body after the last step.

        Args:
            body: number in PyBullet.
            other: only contacts with this body.
            link: only contacts of this link of `body`.

        Returns:
            The contacts, `body` first.
        """
        selection: dict[str, Any] = {"bodyA": body}
        if other is not None:
            selection["bodyB"] = other
        if link is not None:
            selection["linkIndexA"] = link
        points = bullet.getContactPoints(**selection, physicsClientId=self.client)
        return [Contact(p[3], p[4], p[2], p[6], p[7], p[9]) for p in points or ()]

    def overlaps(self, deeper_than: float) -> list[tuple[int, int, float]]:
        """List all pairs of bodies that overlap.

        Args:
            deeper_than: least depth that counts, m.

        Returns:
            The two bodies' numbers and the depth, m, of each pair.
        """
        count = bullet.getNumBodies(physicsClientId=self.client)
        bodies = [bullet.getBodyUniqueId(number, physicsClientId=self.client) for number in range(count)]
        found = []
        for first, second in combinations(bodies, 2):
            points = bullet.getClosestPoints(first, second, 0.0, physicsClientId=self.client)
            depth = max((-point[8] for point in points), default=0.0)
            if depth > deeper_than:
                found.append((first, second, depth))
        return found

    def contact_force(self, body: int, other: int) -> float:
        """Sum the normal forces between two bodies.

        Args:
            body: number in PyBullet.
            other: number in PyBullet.

        Returns:
            The sum, N.
        """
        return sum(self.forces_by_link(body, other).values())

    def forces_by_link(self, body: int, other: int = -1) -> dict[int, float]:
        """Sum the normal forces on each touched link of a body.

        Args:
            body: number in PyBullet.
            other: only contacts with this body; -1 for all contacts.

        Returns:
            The sums by number of the link, N.
        """
        forces: dict[int, float] = {}
        for point in self._points(body) if other < 0 else self._points_between(body, other):
            forces[point[3]] = forces.get(point[3], 0.0) + point[9]
        return forces

    def net_contact_force(self, body: int) -> float:
        """Compute the magnitude of the net force of all contacts on a body, friction included.

        Args:
            body: number in PyBullet.

        Returns:
            The force, N; contacts among its own links do not count.
        """
        fx = fy = fz = 0.0
        for p in self._points(body):
            if p[2] == body:
                continue
            for force, (x, y, z) in ((p[9], p[7]), (p[10], p[11]), (p[12], p[13])):
                fx, fy, fz = fx + force * x, fy + force * y, fz + force * z
        return math.hypot(fx, fy, fz)

    def _points(self, body: int) -> Any:
        """Return the contact points of `body` with anything, in Bullet's form; cached until the next step."""
        points = self._touching.get(body)
        if points is None:
            points = bullet.getContactPoints(body, physicsClientId=self.client) or ()
            self._touching[body] = points
        return points

    def _points_between(self, body: int, other: int) -> Any:
        return bullet.getContactPoints(body, other, physicsClientId=self.client) or ()

    # Pictures.

    def render(self, camera: Camera) -> Image:
        """Render a picture with the TinyRenderer (about 45 ms at 320 × 240).

        Args:
            camera: in W.

        Returns:
            Colours and depth.
        """
        while self._unpainted:
            self._paint(*self._unpainted.popitem())
        view = bullet.computeViewMatrix(camera.eye, camera.target, camera.up)
        projection = bullet.computeProjectionMatrixFOV(
            camera.field_of_view, camera.width / camera.height, camera.near, camera.far
        )
        _, _, pixels, depth, _ = bullet.getCameraImage(
            camera.width,
            camera.height,
            view,
            projection,
            renderer=bullet.ER_TINY_RENDERER,
            shadow=0,
            flags=bullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self.client,
        )
        shape = (camera.height, camera.width)
        rgb = np.reshape(np.asarray(pixels, dtype=np.uint8), (*shape, 4))[:, :, :3]
        z = np.reshape(np.asarray(depth, dtype=np.float64), shape)
        metres = camera.far * camera.near / (camera.far - (camera.far - camera.near) * z)
        return Image(np.ascontiguousarray(rgb), metres)

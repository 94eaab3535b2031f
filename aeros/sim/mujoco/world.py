"""One MuJoCo world: its clock, its steps, and the poses and contacts after them.

A tick is `SUBSTEPS` steps of implicit integration. The coefficients of two surfaces in contact are
multiplied, as everywhere in AEROS; MuJoCo by itself would take the greater.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from aeros.sim.clock import TICK
from aeros.sim.engine.world import Contact
from aeros.sim.geometry import Pose, Vector3, subtract
from aeros.sim.mujoco.client import mujoco
from aeros.sim.mujoco.model import PEOPLE_GROUP, SUBSTEPS, GrowingModel, pose_of
from aeros.sim.mujoco.pictures import RayRenderer
from aeros.sim.pictures.solids import Array

_SEEN_BY_RAYS: Final = np.array([group != PEOPLE_GROUP for group in range(6)], dtype=np.uint8)


class MujocoWorld:
    """A MuJoCo model and its state; worlds share nothing. It implements `EngineWorld`.

    Attributes:
        bodies: the model, to which bodies are added.
        renderer: takes pictures.
        ticks: number of ticks since the clock was set to 0.
        before_step: called in order before each tick.
        before_substep: called in order before each step of the engine, with the share of the tick that has
            passed at its end.
        after_substep: called in order after each step of the engine.
        after_step: called in order after each tick.
    """

    def __init__(self) -> None:
        self.bodies = GrowingModel()
        self.renderer = RayRenderer(self.bodies)
        self.ticks = 0
        self.before_step: list[Callable[[], None]] = []
        self.before_substep: list[Callable[[float], None]] = []
        self.after_substep: list[Callable[[], None]] = []
        self.after_step: list[Callable[[], None]] = []
        self._contacts: list[tuple[int, int, int, int, Vector3, Vector3, float]] | None = []
        # Coefficients of the contacts of the last step, of these pairs of shapes with these surfaces.
        self._mixed_key = b""
        self._surfaces = self._mixed = np.zeros((0, 3))

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.ticks * TICK

    def step(self) -> None:
        """Advance by one tick."""
        for prepare in self.before_step:
            prepare()
        _, data, *_ = built = self.bodies.built()
        for number in range(1, SUBSTEPS + 1):
            for lead in self.before_substep:
                lead(number / SUBSTEPS)
            self._substep(built.model, data)
            for record in self.after_substep:
                record()
        data.xfrc_applied[:] = 0.0
        mujoco.mj_kinematics(built.model, data)
        mujoco.mj_comPos(built.model, data)
        self._contacts = None
        self.ticks += 1
        for note in self.after_step:
            note()

    def close(self) -> None:
        """Forget what calls back; safe to call twice."""
        for called in (self.before_step, self.before_substep, self.after_substep, self.after_step):
            called.clear()

    def push(self, body: int, force: Vector3) -> None:
        """Implement `EngineWorld.push`."""
        built = self.bodies.built()
        built.data.xfrc_applied[built.links[body, -1], :3] += force

    # Measurements.

    def pose(self, body: int, link: int = -1) -> Pose:
        """Implement `EngineWorld.pose`."""
        _, data, links, *_ = self.bodies.built()
        at = links[body, link]
        has_mass = self.bodies.bodies[body][link + 1].inertia is not None
        return pose_of(data.xipos[at] if link < 0 and has_mass else data.xpos[at], data.xquat[at])

    def frame_pose(self, body: int) -> Pose:
        """Implement `EngineWorld.frame_pose`."""
        return self.link_pose(body, -1)

    def link_pose(self, body: int, link: int) -> Pose:
        """Read the pose of the frame of a link, the base too.

        Args:
            body: its number.
            link: number of the link.

        Returns:
            The pose in W.
        """
        _, data, links, *_ = self.bodies.built()
        at = links[body, link]
        return pose_of(data.xpos[at], data.xquat[at])

    def velocity(self, body: int) -> tuple[Array, Array]:
        """Read the velocity of a body's base at its centre of mass.

        Args:
            body: its number.

        Returns:
            Its speed in W (3,), m/s, and its spin (3,), rad/s.
        """
        model, data, links, *_ = self.bodies.built()
        mujoco.mj_comVel(model, data)
        both = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, links[body, -1], both, 0)
        return both[3:], both[:3]

    def joint_position(self, body: int, joint: int) -> float:
        """Implement `EngineWorld.joint_position`."""
        built = self.bodies.built()
        return float(built.data.qpos[built.positions[body, joint]])

    def contacts(self, body: int, other: int | None = None, link: int | None = None) -> list[Contact]:
        """Implement `EngineWorld.contacts`."""
        found = []
        for one, its, another, their, position, normal, force in self._touching():
            if body == one and other in (None, another) and link in (None, its):
                away = (-normal[0], -normal[1], -normal[2])
                found.append(Contact(its, their, another, position, away, force))
            if body == another and other in (None, one) and link in (None, their):
                found.append(Contact(their, its, one, position, normal, force))
        return found

    def net_contact_force(self, body: int) -> float:
        """Compute the magnitude of the net force of all contacts on a body, friction included.

        Args:
            body: its number.

        Returns:
            The force, N; contacts among its own links do not count.
        """
        model, data, _, _, _, owners = self.bodies.built()
        total, wrench = np.zeros(3), np.zeros(6)
        for number in range(data.ncon):
            contact = data.contact[number]
            first, second = owners[contact.geom, 0].tolist()
            if first != second and body in (first, second):
                mujoco.mj_contactForce(model, data, number, wrench)
                force = contact.frame.reshape(3, 3).T @ wrench[:3]
                total += force if body == second else -force
        return float(np.linalg.norm(total))

    def first_on_way(self, start: Vector3, end: Vector3) -> tuple[int, float] | None:
        """Implement `EngineWorld.first_on_way`."""
        model, data, _, _, _, owners = self.bodies.built()
        length, met = math.dist(start, end), np.full(1, -1, dtype=np.int32)
        way = np.array(subtract(end, start)) / length
        at = mujoco.mj_ray(model, data, np.array(start), way, _SEEN_BY_RAYS, 1, -1, met)
        if met[0] < 0 or at > length:
            return None
        return int(owners[met[0], 0]), length - at

    def distance(self, body: int, other: int, within: float, *, with_margin: bool = True) -> float:
        """Measure the distance of two bodies.

        Args:
            body: number of one.
            other: number of the other.
            within: range of the measurement, m.
            with_margin: from the rounded hulls of `body`, which enclose its links; else from what collides.

        Returns:
            The distance, m; negative if they overlap, inf if it is out of the range.
        """
        model, data, _, _, _, owners = self.bodies.built()
        nearest, beyond = within, True
        ways = np.empty(6)
        for mine in np.flatnonzero(owners[:, 0] == body).tolist():
            margin = self.bodies.geoms[mine].shape.margin if with_margin else 0.0
            for theirs in np.flatnonzero(owners[:, 0] == other).tolist():
                reach = float(model.geom_rbound[mine] + model.geom_rbound[theirs])
                apart = math.dist(data.geom_xpos[mine], data.geom_xpos[theirs]) - reach - margin
                if apart > nearest:
                    continue
                found = mujoco.mj_geomDistance(model, data, mine, theirs, nearest + margin, ways) - margin
                if found < nearest:
                    nearest, beyond = found, False
        return math.inf if beyond else nearest

    def overlaps(self, deeper_than: float) -> Sequence[tuple[int, int, float]]:
        """Implement `EngineWorld.overlaps`."""
        count = len(self.bodies.bodies)
        found = []
        for first in range(count):
            for second in range(first + 1, count):
                depth = -self.distance(first, second, 0.0, with_margin=False)
                if depth > deeper_than and depth < math.inf:
                    found.append((first, second, depth))
        return found

    # Internals.

    def _substep(self, model: Any, data: Any) -> None:
        """Do what `mj_step` does, with the frictions of touching surfaces multiplied."""
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_factorM(model, data)
        mujoco.mj_collision(model, data)
        if data.ncon:
            self._mix_frictions(data)
        mujoco.mj_makeConstraint(model, data)
        mujoco.mj_transmission(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)
        mujoco.mj_implicit(model, data)

    def _mix_frictions(self, data: Any) -> None:
        """Multiply the coefficients of touching surfaces, as PyBullet does."""
        geoms: NDArray[np.int32] = data.contact.geom
        surfaces, key = self.bodies.frictions, geoms.tobytes()
        if surfaces is not self._surfaces or key != self._mixed_key:
            self._surfaces, self._mixed_key = surfaces, key
            self._mixed = _products(surfaces[geoms[:, 0]], surfaces[geoms[:, 1]])
        data.contact.friction[:] = self._mixed

    def _touching(self) -> list[tuple[int, int, int, int, Vector3, Vector3, float]]:
        """Return body, link, body, link, position, normal and force of each contact; cached in a tick."""
        if self._contacts is None:
            _, data, _, _, _, owners = self.bodies.built()
            contact = data.contact
            places = contact.efc_address
            # With elliptic cones the first force of a contact is the normal one.
            forces = data.efc_force[places].tolist() if data.nefc else [0.0] * data.ncon
            self._contacts = [
                (one, its, another, their, (x, y, z), (a, b, c), force)
                for ((one, its), (another, their)), (x, y, z), (a, b, c), force, place in zip(
                    owners[contact.geom].tolist(),
                    contact.pos.tolist(),
                    contact.frame[:, :3].tolist(),
                    forces,
                    places.tolist(),
                    strict=True,
                )
                if place >= 0
            ]
        return self._contacts


def _products(first: Array, second: Array) -> Array:
    """Return the five coefficients of each contact (n, 5) of surfaces of the frictions (n, 3)."""
    lateral = first[:, 0] * second[:, 0]
    spinning = first[:, 0] * second[:, 1] + second[:, 0] * first[:, 1]
    rolling = first[:, 0] * second[:, 2] + second[:, 0] * first[:, 2]
    mixed = np.stack((lateral, lateral, spinning, rolling, rolling), axis=1)
    coefficients: Array = np.maximum(mixed, mujoco.mjMINMU)
    return coefficients

"""One PyBullet world: its clock, its steps, and the poses and contacts after them.

Frame W: origin on the table top (or floor) under the arm's base, z up. SI units; quaternions x, y, z, w.
Settings: 240 Hz and 100 solver iterations. With 50, a filling of 9 g creeps out of the fingers.
`deterministicOverlappingPairs` makes a rebuilt world repeat bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations
from typing import Any, Final

from aeros.sim.bullet.body_factory import BodyFactory
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.renderer import Renderer
from aeros.sim.clock import TICK
from aeros.sim.engine.world import GRAVITY, Contact
from aeros.sim.geometry import UPRIGHT, Pose, Vector3

_NO_OFFSET: Final = (0.0, 0.0, 0.0)


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


class PhysicsWorld:
    """A PyBullet client of its own; worlds share nothing. It implements `EngineWorld`.

    Args:
        substeps: steps of the engine in a tick. The rate of control stays one tick.

    Raises:
        ValueError: there is not one step at least.

    Attributes:
        client: number of the client; -1 once closed.
        bodies: adds bodies and sets their friction.
        renderer: takes pictures.
        forces: forces and torques on bodies in the next tick.
        ticks: number of steps since the clock was set to 0.
        before_step: called in order before each tick.
        before_substep: called in order before each step of the engine, with the share of the tick at its end.
        after_substep: called in order after each step of the engine.
        after_step: called in order after each tick.
    """

    def __init__(self, substeps: int = 1) -> None:
        if substeps < 1:
            raise ValueError(f"{substeps} steps in a tick: one is the least")
        self._substeps = substeps
        self.client: int = bullet.connect(bullet.DIRECT)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=TICK / substeps,
            numSolverIterations=100,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        bullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
        self.bodies = BodyFactory(self.client)
        self.renderer = Renderer(self.client)
        self.ticks = 0
        self.before_step: list[Callable[[], None]] = []
        self.before_substep: list[Callable[[float], None]] = []
        self.after_substep: list[Callable[[], None]] = []
        self.after_step: list[Callable[[], None]] = []
        self.forces = TickForces(self.client)
        # Contact points and joint states by body after the last step, cached on first query.
        self._touching: dict[int, Any] = {}
        self._joint_states: dict[tuple[int, tuple[int, ...]], Any] = {}

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.ticks * TICK

    def step(self) -> None:
        """Advance by one tick."""
        for prepare in self.before_step:
            prepare()
        for number in range(1, self._substeps + 1):
            for lead in self.before_substep:
                lead(number / self._substeps)
            self.forces.apply()
            bullet.stepSimulation(physicsClientId=self.client)
            self._touching.clear()
            self._joint_states.clear()
            for record in self.after_substep:
                record()
        self.forces.clear()
        self.ticks += 1
        for note in self.after_step:
            note()

    def close(self) -> None:
        """End the client; safe to call twice."""
        if self.client >= 0:
            bullet.disconnect(physicsClientId=self.client)
            for called in (self.before_step, self.before_substep, self.after_substep, self.after_step):
                called.clear()
            self.client = self.bodies.client = self.renderer.client = -1

    def push(self, body: int, force: Vector3) -> None:
        """Push a body's base at its centre of mass during the next tick.

        Args:
            body: number in PyBullet.
            force: in W, N.
        """
        self.forces.push(body, force)

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

    def frame_pose(self, body: int) -> Pose:
        """Read the pose of a body's own frame, in which its file or declaration describes it.

        Args:
            body: number in PyBullet.

        Returns:
            The pose in W; that of its centre of mass if a model's base has no inertial offset.
        """
        info = bullet.getDynamicsInfo(body, -1, physicsClientId=self.client)
        if info[3] == _NO_OFFSET and info[4] == UPRIGHT:
            return self.pose(body)
        to_frame = bullet.invertTransform(info[3], info[4])
        return Pose(*bullet.multiplyTransforms(*self.pose(body), *to_frame))

    def joint_position(self, body: int, joint: int) -> float:
        """Read the position of a joint.

        Args:
            body: number in PyBullet.
            joint: number of the joint.

        Returns:
            The position, rad or m.
        """
        return float(bullet.getJointState(body, joint, physicsClientId=self.client)[0])

    def joint_states(self, body: int, joints: tuple[int, ...]) -> Any:
        """Read the states of joints after the last step; cached until the next step.

        Args:
            body: number in PyBullet.
            joints: numbers of the joints.

        Returns:
            Position (rad or m), speed (rad/s or m/s), reaction and motor torque (N·m) or force (N) of each
            joint, in PyBullet's form.
        """
        states = self._joint_states.get((body, joints))
        if states is None:
            states = bullet.getJointStates(body, joints, physicsClientId=self.client)
            self._joint_states[body, joints] = states
        return states

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

    def first_on_way(self, start: Vector3, end: Vector3) -> tuple[int, float] | None:
        """Find what a ray meets first.

        Args:
            start: in W, m.
            end: in W, m.

        Returns:
            Number of the body, and the way that was left to the end, m; None if the way is free.
        """
        body, _, share, *_ = bullet.rayTest(start, end, physicsClientId=self.client)[0]
        return None if body < 0 else (body, (1.0 - share) * math.dist(start, end))

    def overlaps(self, deeper_than: float) -> list[tuple[int, int, float]]:
        """List all pairs of bodies that overlap.

        Args:
            deeper_than: least depth that counts, m.

        Returns:
            The two bodies' numbers and the depth, m, of each pair.
        """
        count = bullet.getNumBodies(physicsClientId=self.client)
        bodies = [bullet.getBodyUniqueId(number, physicsClientId=self.client) for number in range(count)]
        found: list[tuple[int, int, float]] = []
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
        if other < 0:
            points = self._points(body)
        else:
            points = bullet.getContactPoints(body, other, physicsClientId=self.client) or ()
        for point in points:
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

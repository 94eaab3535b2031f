"""An arm with its hand in a `PhysicsWorld`: motors in, measured values out.

The arm stands fixed or on a carriage: two force-limited prismatic joints along x and y.
Each arm motor gets the torque that the commanded motion needs by inverse dynamics, and a position controller
(feed-forward velocity, gain 0.3) corrects it by at most the robot's correction. Both together stay inside the
official torque limits. So an obstacle meets the arm's momentum and the correction, not all that the motors
can give. Joints are placed once, when the robot is built; from then on only motors move them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import hypot
from typing import Final

from aeros.kinematic_chain import pairs_that_may_meet
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.external_torques import ExternalTorqueObserver
from aeros.sim.bullet.robot_urdf import LoadedRobot, load_robot_body
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.robot import CARRIAGE_CORRECTION, CARRIAGE_FORCE, PhysicalRobot
from aeros.sim.robot.contact_estimate import estimate_contact_force
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions, RobotState

_POSITION_GAIN: Final = 0.3
"""Position gain of all arm and base motors (of 1): tracks within 0.006 rad."""


class BulletRobot(PhysicalRobot):
    """A robot simulated in PyBullet.

    Args:
        world: the world to add it to.
        options: carriage, base position, initial posture and friction.
        odometry: of the carriage; without drift if None.
    """

    def __init__(
        self, world: PhysicsWorld, options: RobotOptions, odometry: WheelOdometry | None = None
    ) -> None:
        super().__init__(options, odometry)
        self._world = world
        loaded = load_robot_body(options, world.client)
        self.body, self._arm, self.fingers = loaded.number, list(loaded.arm), loaded.fingers
        _collide_where_links_can_meet(loaded, self.model, world.client)
        self._tool, self._wrist, self._drive = loaded.tool, loaded.wrist, list(loaded.carriage)
        self._sensed = _movable_joints(self.body, world.client)
        self._arm_start = self._sensed.index(self._arm[0])
        self._drives = _Drives(world, loaded, self._sensed, self.torque_limits, self.model.servos.correction)
        self._external = ExternalTorqueObserver(world, self.body, self._sensed, self._drives.note_corrections)
        if self._drive:
            world.after_step.append(lambda: self._count_wheels(*self._external.positions[:2]))
        self._assemble()

    def _assemble(self) -> None:
        """Set friction and couplings and place the joints; the only place that resets joint states."""
        client = self._world.client
        for joint, q in zip(self._arm, self.q_command, strict=True):
            bullet.resetJointState(self.body, joint, q, physicsClientId=client)
        for finger in self.fingers:
            bullet.resetJointState(self.body, finger, self.model.hand.widest_gap / 2, physicsClientId=client)
        self.set_finger_friction(self.finger_friction)
        # The hand drives both fingers with one motor; without the gear, grasps are 15 mm off centre.
        gear = bullet.createConstraint(
            self.body,
            self.fingers[0],
            self.body,
            self.fingers[1],
            jointType=bullet.JOINT_GEAR,
            jointAxis=[1, 0, 0],
            parentFramePosition=[0, 0, 0],
            childFramePosition=[0, 0, 0],
            physicsClientId=client,
        )
        bullet.changeConstraint(gear, gearRatio=-1, erp=0.1, maxForce=50, physicsClientId=client)
        bullet.enableJointForceTorqueSensor(self.body, self._wrist, True, physicsClientId=client)
        self.grip(*self.grip_command)
        self.hold()

    # Motors.

    def _set_arm_points(self, q: Vector, qd: Vector, acceleration: Vector, strength: float) -> None:
        """Implement `PhysicalRobot._set_arm_points`."""
        self._drives.set_points(q, qd, acceleration, strength)

    def _set_base_points(self, xy: Vector, speed: Vector, acceleration: Vector) -> None:
        """Implement `PhysicalRobot._set_base_points`."""
        self._drives.base_points(xy, speed, acceleration)

    def set_finger_motors(self, width: float, force: float) -> None:
        """Implement `PhysicalRobot.set_finger_motors`."""
        for finger in self.fingers:
            bullet.setJointMotorControl2(
                self.body,
                finger,
                bullet.POSITION_CONTROL,
                targetPosition=width / 2.0,
                force=force,
                maxVelocity=self.model.hand.finger_speed,
                physicsClientId=self._world.client,
            )

    def set_finger_friction(self, friction: float) -> None:
        """Implement `PhysicalRobot.set_finger_friction`."""
        for finger in self.fingers:
            self._world.bodies.set_friction(self.body, finger, friction)

    # Sensors.

    def read_sensors(self) -> RobotState:
        """Implement `Robot.read_sensors`."""
        client = self._world.client
        positions, rates, _, _ = zip(*self._world.joint_states(self.body, self._sensed), strict=True)
        # The joints of the carriage come before those of the arm, and the fingers after.
        first, fingers = self._arm_start, self._arm_start + len(self._arm)
        tool = bullet.getLinkState(
            self.body, self._tool, computeLinkVelocity=1, computeForwardKinematics=1, physicsClientId=client
        )
        vx, vy, vz = tool[6]
        x, y, z = tool[4]
        off_x, off_y = self.odometry.drift
        return RobotState(
            q=positions[first:fingers],
            qd=rates[first:fingers],
            torque=tuple(self._drives.efforts[first:fingers]),
            tool_position=(x + off_x, y + off_y, z),
            tool_speed=float((vx * vx + vy * vy + vz * vz) ** 0.5),
            # Closed fingers penetrate each other slightly; a gap is never measured as negative.
            finger_gap=max(0.0, positions[fingers] + positions[fingers + 1]),
            finger_speed=max(abs(rates[fingers]), abs(rates[fingers + 1])),
            base_position=self._odometry_position(positions[:first]),
            base_velocity=(rates[0], rates[1], 0.0) if self._drive else _ZERO_VELOCITY,
        )

    def finger_forces(self) -> tuple[float, float]:
        """Implement `Robot.finger_forces` by the motors, whose forces are negative as they close."""
        left, right = self._world.joint_states(self.body, self._sensed)[-2:]
        return max(0.0, -left[3]), max(0.0, -right[3])

    def contact_force(self) -> float:
        """Implement `Robot.contact_force` from external torques of arm and carriage."""
        first, fingers = self._arm_start, self._arm_start + len(self._arm)
        outside = self._external.torques
        arm = estimate_contact_force(
            self.model, self._external.positions[first:fingers], outside[first:fingers]
        )
        return max(arm, hypot(*outside[:first]))

    def net_contact_force(self) -> float:
        """Implement `PhysicalRobot.net_contact_force`."""
        return self._world.net_contact_force(self.body)

    def wrist_vertical_force(self) -> float:
        """Implement `Robot.wrist_vertical_force`.

        It includes the weight of hand and load: compare with a reading from before contact.
        """
        client = self._world.client
        reaction = bullet.getJointState(self.body, self._wrist, physicsClientId=client)[2]
        # The hand points down, so the sensor's z is -z of W; the joint reacts to the load.
        load: float = reaction[2]
        return load


class _Drives:
    """The motors of arm and carriage: before each step, modelled effort and bounded correction are set.

    In a tick of several steps the set points go evenly from those of the tick before to the new ones.

    Args:
        world: the world.
        loaded: the robot's numbers.
        movable: numbers of all movable joints; those of arm and carriage follow each other.
        limits: greatest torque of each motor, N·m; read at each tick.
        correction: greatest torque by which each position controller corrects the modelled torque, N·m.

    Attributes:
        efforts: of the motors of all movable joints in the last tick, N·m or N.
    """

    def __init__(
        self,
        world: PhysicsWorld,
        loaded: LoadedRobot,
        movable: tuple[int, ...],
        limits: Sequence[float],
        correction: Sequence[float],
    ) -> None:
        arm, carriage = loaded.arm, loaded.carriage
        self._world = world
        self._body = loaded.number
        self._correction = correction
        self._gains, self._ones = [_POSITION_GAIN] * len(arm), [1.0] * len(arm)
        self._no_arm_acceleration: Final = [0.0] * len(arm)
        self._arm = arm
        self._carriage = carriage
        self._movable = movable
        self._places = _places(movable, arm)
        self._carriage_places = _places(movable, carriage)
        self._rates = [0.0] * len(movable)
        self._accelerations = [0.0] * len(movable)
        self._xy: list[float] = [0.0] * len(carriage)
        self._base_speed: list[float] = self._xy
        self._no_acceleration: Final = self._xy
        self._base_acceleration: list[float] = self._xy
        self._q: list[float] = []
        self._q_before: list[float] = []
        self._xy_before: list[float] = self._xy
        self._qd: list[float] = [0.0] * len(arm)
        self._acceleration: list[float] = self._qd
        self._limits = limits
        self._strength = 1.0
        # Of each motor of arm and carriage: its place, the modelled effort, and the greatest correction.
        self._given: list[tuple[int, float, float]] = []
        self.efforts: list[float] = [0.0] * len(movable)
        world.before_substep.append(self._set_motors)
        world.after_step.append(self._keep_points)

    def set_points(self, q: Vector, qd: Vector, acceleration: Vector, strength: float) -> None:
        """Take set points for the next tick.

        Args:
            q: joint positions, rad.
            qd: joint speeds, rad/s.
            acceleration: joint accelerations, rad/s²; for the next tick alone.
            strength: share of the motors' torque limits, in [0, 1].
        """
        self._q, self._qd, self._acceleration = q.tolist(), qd.tolist(), acceleration.tolist()
        self._strength = strength

    def base_points(self, xy: Vector, speed: Vector, acceleration: Vector) -> None:
        """Take the carriage's set points for the next tick.

        Args:
            xy: position (2,) relative to its start, m.
            speed: velocity (2,), m/s.
            acceleration: (2,), m/s²; for the next tick alone.
        """
        self._xy, self._base_speed = xy.tolist(), speed.tolist()
        self._base_acceleration = acceleration.tolist()

    def note_corrections(self, corrections: Sequence[float]) -> list[float]:
        """Add the modelled efforts of the last tick to the corrections that PyBullet reports.

        Args:
            corrections: efforts of the position controllers of all movable joints, N·m or N.

        Returns:
            `efforts` from now on.
        """
        self.efforts = list(corrections)
        for place, modelled, most in self._given:
            # Of a motor without any force PyBullet reports what it gave last.
            self.efforts[place] = modelled + max(-most, min(most, corrections[place]))
        return self.efforts

    def _keep_points(self) -> None:
        """Note where the tick has led to; accelerations are for one tick alone."""
        self._q_before, self._xy_before = self._q, self._xy
        self._acceleration, self._base_acceleration = self._no_arm_acceleration, self._no_acceleration

    def _set_motors(self, share: float) -> None:
        """Set the motors for one step of the engine, at whose end `share` of the tick has passed.

        The modelled torque is of the measured posture and the commanded speed and acceleration: joints that
        an obstacle holds back are not pushed on by the model.
        """
        client = self._world.client
        positions = [state[0] for state in self._world.joint_states(self._body, self._movable)]
        self._rates[self._places], self._accelerations[self._places] = self._qd, self._acceleration
        self._rates[self._carriage_places] = self._base_speed
        self._accelerations[self._carriage_places] = self._base_acceleration
        limits = [self._strength * limit for limit in self._limits]
        torques = bullet.calculateInverseDynamics(
            self._body, positions, self._rates, self._accelerations, physicsClientId=client
        )
        modelled = [
            max(-limit, min(limit, torque))
            for torque, limit in zip(torques[self._places], limits, strict=True)
        ]
        greatest = [
            min(most, limit - abs(torque))
            for most, limit, torque in zip(self._correction, limits, modelled, strict=True)
        ]
        self._given = list(zip(range(self._places.start, self._places.stop), modelled, greatest, strict=True))
        bullet.setJointMotorControlArray(
            self._body,
            self._arm,
            bullet.POSITION_CONTROL,
            targetPositions=_between(self._q_before, self._q, share),
            targetVelocities=self._qd,
            forces=greatest,
            positionGains=self._gains,
            velocityGains=self._ones,
            physicsClientId=client,
        )
        bullet.setJointMotorControlArray(
            self._body, self._arm, bullet.TORQUE_CONTROL, forces=modelled, physicsClientId=client
        )
        if self._carriage:
            self._set_carriage(torques[self._carriage_places], share, client)

    def _set_carriage(self, forces: Sequence[float], share: float, client: int) -> None:
        """Set the carriage's motors for one step of the engine, with the modelled forces, N."""
        bounded = [max(-CARRIAGE_FORCE, min(CARRIAGE_FORCE, force)) for force in forces]
        greatest = [min(CARRIAGE_CORRECTION, CARRIAGE_FORCE - abs(force)) for force in bounded]
        self._given += zip(range(len(bounded)), bounded, greatest, strict=True)
        bullet.setJointMotorControlArray(
            self._body,
            self._carriage,
            bullet.POSITION_CONTROL,
            targetPositions=_between(self._xy_before, self._xy, share),
            targetVelocities=self._base_speed,
            forces=greatest,
            positionGains=[_POSITION_GAIN] * len(bounded),
            velocityGains=[1.0] * len(bounded),
            physicsClientId=client,
        )
        bullet.setJointMotorControlArray(
            self._body, self._carriage, bullet.TORQUE_CONTROL, forces=bounded, physicsClientId=client
        )


def _between(before: list[float], after: list[float], share: float) -> list[float]:
    """Return the positions at a share of the way; `after` if there is none before."""
    if share == 1.0 or not before:
        return after
    return [a + share * (b - a) for a, b in zip(before, after, strict=True)]


def _places(movable: tuple[int, ...], joints: Sequence[int]) -> slice:
    """Return the places of joints among the movable ones; they follow each other."""
    return slice(movable.index(joints[0]), movable.index(joints[-1]) + 1) if joints else slice(0)


_ZERO_VELOCITY: Final = (0.0, 0.0, 0.0)


def _collide_where_links_can_meet(loaded: LoadedRobot, model: RobotModel, client: int) -> None:
    """Let links collide that can meet by the robot's data; not neighbours, nor parts of hand and fingers."""
    meeting = {
        frozenset((a, b))
        for inner, outer in pairs_that_may_meet(model.body.hulls, model.body.exempt_pairs)
        for a in loaded.links[inner.link]
        for b in loaded.links[outer.link]
    }
    body = loaded.number
    count = bullet.getNumJoints(body, physicsClientId=client)
    for a, b in combinations(range(-1, count), 2):
        bullet.setCollisionFilterPair(body, body, a, b, frozenset((a, b)) in meeting, physicsClientId=client)


def _movable_joints(body: int, client: int) -> tuple[int, ...]:
    count = bullet.getNumJoints(body, physicsClientId=client)
    kinds = (bullet.getJointInfo(body, joint, physicsClientId=client)[2] for joint in range(count))
    return tuple(joint for joint, kind in enumerate(kinds) if kind != bullet.JOINT_FIXED)

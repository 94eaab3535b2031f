"""An arm with its hand in a `MujocoWorld`: motors in, measured values out.

The arm stands fixed or on a carriage: two force-limited prismatic joints along x and y. Each motor gives the
torque that the commanded motion needs by inverse dynamics, and a servo corrects it by at most
the robot's correction. Both together stay inside the official torque limits. Joints are placed once, when the
robot is built; from then on only motors move them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import hypot

import numpy as np

from aeros.kinematic_chain import pairs_that_may_meet
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.geometry import UPRIGHT, Pose, to_world
from aeros.sim.mujoco.client import mujoco
from aeros.sim.mujoco.drives import MujocoDrives
from aeros.sim.mujoco.plans import names_of_joints, names_of_links
from aeros.sim.mujoco.robot_plan import CARRIAGE_JOINTS, FINGERS, arm_joints, hull_of_link, plan_robot
from aeros.sim.mujoco.world import MujocoWorld
from aeros.sim.pictures.ray_caster import PlacedSolid
from aeros.sim.pictures.scene_solids import carriage_solid, robot_solids
from aeros.sim.robot.contact_estimate import estimate_contact_force
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions, RobotState


class MujocoRobot(PhysicalRobot):
    """A robot simulated in MuJoCo.

    Args:
        world: the world to add it to.
        options: carriage, base position, initial posture and friction.
        odometry: of the carriage; without drift if None.
    """

    def __init__(
        self, world: MujocoWorld, options: RobotOptions, odometry: WheelOdometry | None = None
    ) -> None:
        super().__init__(options, odometry)
        self._world = world
        links = plan_robot(options)
        self.body = world.bodies.add(links, Pose(options.base, UPRIGHT), moves=False)
        number, joints = names_of_links(links), names_of_joints(links)
        self.fingers = (number[FINGERS[0]], number[FINGERS[1]])
        self._hand = number["hand"]
        self._exclude(number)
        world.bodies.couple(self.body, *self.fingers)
        carriage = CARRIAGE_JOINTS if options.carriage else ()
        self._drives = MujocoDrives(
            world,
            self.body,
            self.model,
            [joints[name] for name in (*carriage, *arm_joints(self.model))],
            self.fingers,
            self.torque_limits,
        )
        self._first = len(carriage)
        self._state: RobotState | None = None
        gap = self.model.hand.widest_gap
        self._place_joints((*(0.0,) * len(carriage), *self.q_command.tolist(), *(gap / 2.0,) * 2))
        world.after_step.append(self._note_tick)
        world.renderer.robot = self._solids
        self.grip(*self.grip_command)
        self.hold()

    def _exclude(self, number: dict[str, int]) -> None:
        """Let links collide that can meet by the robot's data; not neighbours, nor hand and fingers."""
        meeting = {
            frozenset((inner.link, outer.link)): outer.joint - inner.joint
            for inner, outer in pairs_that_may_meet(self.model.body.hulls, self.model.body.exempt_pairs)
        }
        for first, second in combinations(number, 2):
            apart = meeting.get(frozenset(map(hull_of_link, (first, second))), 0)
            if apart <= 1:
                self._world.bodies.set_contact(self.body, number[first], number[second], touch=apart == 1)

    def _place_joints(self, start: Sequence[float]) -> None:
        """Set the positions of all joints; the only place that does so."""
        built = self._world.bodies.built()
        built.data.qpos[: len(start)] = start
        mujoco.mj_kinematics(built.model, built.data)
        mujoco.mj_comPos(built.model, built.data)
        self._drives.note_positions()

    def _note_tick(self) -> None:
        self._state = None
        if self._first:
            x, y = self._drives.positions[:2]
            self._count_wheels(x, y)

    # Motors.

    def _set_arm_points(self, q: Vector, qd: Vector, acceleration: Vector, strength: float) -> None:
        """Implement `PhysicalRobot._set_arm_points`."""
        self._drives.set_arm(q, qd, acceleration, strength)

    def _set_base_points(self, xy: Vector, speed: Vector, acceleration: Vector) -> None:
        """Implement `PhysicalRobot._set_base_points`."""
        self._drives.set_base(xy, speed, acceleration)

    def set_finger_motors(self, width: float, force: float) -> None:
        """Implement `PhysicalRobot.set_finger_motors`."""
        self._drives.set_fingers(width, force)

    def set_finger_friction(self, friction: float) -> None:
        """Implement `PhysicalRobot.set_finger_friction`."""
        for finger in self.fingers:
            self._world.bodies.set_link_friction(self.body, finger, friction)

    # Sensors.

    def read_sensors(self) -> RobotState:
        """Implement `Robot.read_sensors`."""
        if self._state is None:
            self._state = self._read()
        return self._state

    def _read(self) -> RobotState:
        built, first = self._world.bodies.built(), self._first
        positions, rates, fingers = self._drives.positions, self._drives.rates, first + self.model.joint_count
        tool = (0.0, 0.0, self.model.hand.tool)
        x, y, z = to_world(self._world.link_pose(self.body, self._hand), tool)
        jacobian = np.zeros((3, built.model.nv))
        mujoco.mj_jac(
            built.model, built.data, jacobian, None, np.array((x, y, z)), built.links[self.body, self._hand]
        )
        vx, vy, vz = (jacobian @ built.data.qvel).tolist()
        off_x, off_y = self.odometry.drift if first else (0.0, 0.0)
        return RobotState(
            q=positions[first:fingers],
            qd=rates[first:fingers],
            torque=tuple(self._drives.efforts[first:fingers]),
            tool_position=(x + off_x, y + off_y, z),
            tool_speed=hypot(vx, vy, vz),
            finger_gap=max(0.0, positions[fingers] + positions[fingers + 1]),
            finger_speed=max(abs(rates[fingers]), abs(rates[fingers + 1])),
            base_position=self._odometry_position(positions[:first]),
            base_velocity=(rates[0], rates[1], 0.0) if first else (0.0, 0.0, 0.0),
        )

    def finger_forces(self) -> tuple[float, float]:
        """Implement `Robot.finger_forces` by the motors, whose forces are negative as they close."""
        left, right = self._drives.efforts[-2:]
        return max(0.0, -left), max(0.0, -right)

    def contact_force(self) -> float:
        """Implement `Robot.contact_force` from external torques of arm and carriage."""
        first, outside = self._first, self._drives.external
        arm = estimate_contact_force(
            self.model, self.read_sensors().q, outside[first : first + self.model.joint_count]
        )
        return max(arm, hypot(*outside[:first]))

    def net_contact_force(self) -> float:
        """Implement `PhysicalRobot.net_contact_force`."""
        return self._world.net_contact_force(self.body)

    def wrist_vertical_force(self) -> float:
        """Implement `Robot.wrist_vertical_force`: what the hand exerts on the last link.

        It includes the weight of hand and load: compare with a reading from before contact.
        """
        built = self._world.bodies.built()
        mujoco.mj_rnePostConstraint(built.model, built.data)
        return -float(built.data.cfrc_int[built.links[self.body, self._hand], 5])

    def _solids(self) -> Iterator[PlacedSolid]:
        """Yield the solids that cameras see of it."""
        base, _ = self.true_points()
        yield from robot_solids(self.model, self.read_sensors().q, base)
        if self._first:
            yield carriage_solid(base)

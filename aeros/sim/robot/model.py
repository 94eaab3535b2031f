"""A robot as data: chain, limits, hand, postures, servos and masses, as a robot file states them.

Planning, profiles, kinematics, bounds and simulators take it as an argument; `robot_file` reads it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, sin, tan
from typing import Final, NamedTuple

import numpy as np

from aeros.kinematic_chain import (
    JointFrame,
    Mounting,
    frames_of,
    is_prismatic,
    mounting_of,
    point_derivative,
    zero_angle,
)
from aeros.runtime.ports import JointVector, RobotBody, Vec3
from aeros.sim.robot.body import Capsule
from aeros.sim.robot.limits import JointLimits, ToolPointLimits, Vector

_LIMIT_MARGIN: Final = 0.02
"""Distance of solutions from the official limits, rad or m: room for tracking error (≤ 0.006 rad)."""


def links_of(joints: int) -> tuple[str, ...]:
    """Name the links of an arm.

    Args:
        joints: number of its joints.

    Returns:
        The names, from the base outwards.
    """
    return ("foot", *(f"link{number}" for number in range(1, joints + 1)), "hand", "fingers")


@dataclass(frozen=True)
class LinkMass:
    """Mass of a link.

    Attributes:
        mass: kg.
        centre: centre of mass in the frame of the link's joint, of a palm in that of the hand, m.
        inertia: xx, yy, zz, xy, xz and yz about the centre of mass, kg·m².
    """

    mass: float
    centre: Vec3
    inertia: tuple[float, ...]


@dataclass(frozen=True)
class TwoFingers:
    """A gripper whose two fingers move in parallel, in the frame of the hand, fingers closed.

    That frame has its origin on the flange, z along the last joint's axis, and y along the way of the
    fingers. The second finger is the first one, turned by 180 degrees about z.

    Attributes:
        palm: mass of the hand without its fingers; its shape is the hull of the link `hand`.
        finger_mass: of one finger, kg.
        boxes: boxes of the finger on the side of +y: lengths of the edges and middle, m.
    """

    palm: LinkMass
    finger_mass: float
    boxes: tuple[tuple[Vec3, Vec3], ...]


@dataclass(frozen=True)
class HandMount:
    """A gripper with two fingers, and its mounting on the last joint.

    Attributes:
        flange: distance of the flange from the last joint's frame, along its axis, m.
        turn: angle by which the hand is mounted turned about that axis, rad.
        tool: distance of the tool centre point from the flange along the axis, m.
        widest_gap: widest distance between the finger pads, m.
        finger_speed: greatest speed of one finger, m/s.
        greatest_force: greatest continuous grip force, N.
        gripper: masses and finger shapes of another gripper than the Franka Hand; None for this one.
    """

    flange: float
    turn: float
    tool: float
    widest_gap: float
    finger_speed: float
    greatest_force: float
    gripper: TwoFingers | None = None

    def from_last_joint(self, point: Vec3) -> Vec3:
        """Express a point of the last joint's frame in that of the hand.

        Args:
            point: in the frame of the last joint, m.

        Returns:
            The same point in the frame of the hand, m.
        """
        # With the tangent, which is then exact, turns by 45 degrees add no rounding of their own.
        x, y, z = point
        c, t = cos(self.turn), round(tan(self.turn), 12)
        return (c * (x + t * y), c * (y - t * x), z - self.flange)


@dataclass(frozen=True, eq=False)
class Postures:
    """Postures that inverse kinematics begins at and leans to.

    Attributes:
        ready: posture in which arms start, its tool pointing down, rad or m (n,).
        lean_weights: weight with which each joint is drawn to `ready` by a spare degree of freedom (n,);
            0 for joints that follow the target's bearing and yaw.
        search: differences from `ready`, turned to the target, at which to search for a solution, rad or m;
            each (n,).
    """

    ready: Vector
    lean_weights: Vector
    search: tuple[Vector, ...]


@dataclass(frozen=True)
class ServoSettings:
    """Settings of the joints' servos and of the estimate of contact forces; each has one value per joint.

    Units are those of revolute joints; of prismatic joints m replaces rad, and N replaces N·m.

    Attributes:
        correction: greatest torque by which a position controller corrects the modelled torque, N·m.
        stiffness: gain of the servo on MuJoCo, N·m/rad.
        damping: gain of the servo on MuJoCo, N·m·s/rad.
        felt_torque: external torque below which a joint is not known to feel a contact, N·m.
    """

    correction: tuple[float, ...]
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    felt_torque: tuple[float, ...]


@dataclass(frozen=True)
class Dynamics:
    """Masses of the moving links, and what the joints add.

    Units are those of revolute joints; of prismatic joints they are kg, N·s/m and N.

    Attributes:
        links: masses of the links 1 to n.
        armature: inertia of a motor at its joint, kg·m².
        damping: viscous friction of a joint, N·m·s/rad.
        dry_friction: dry friction of a joint, N·m.
    """

    links: tuple[LinkMass, ...]
    armature: float
    damping: float
    dry_friction: float


@dataclass(frozen=True)
class StockUrdf:
    """A URDF that comes with PyBullet and has the arm with its hand.

    Attributes:
        path: its path in PyBullet's data.
        base: name of its base link.
        joints: names of the arm's joints, from the base outwards.
    """

    path: str
    base: str
    joints: tuple[str, ...]


class ArmMount(NamedTuple):
    """Place of an arm that stands on a link of another one.

    Attributes:
        prefix: prefix of its links' names.
        at: position of its base in the frame of the joint that carries it, m.
        roll_pitch_yaw: orientation of its base there, about fixed axes as in URDF, rad.
        joint: number of the moving arm's joints that carry it; 0 if both stand on one base.
    """

    prefix: str
    at: Vec3
    roll_pitch_yaw: Vec3 = (0.0, 0.0, 0.0)
    joint: int = 0

    @property
    def frame(self) -> JointFrame:
        """Frame of its base in that of the joint: Rz(yaw)·Ry(pitch)·Rx(roll)."""
        (cr, sr), (cp, sp), (cy, sy) = ((cos(angle), sin(angle)) for angle in self.roll_pitch_yaw)
        return JointFrame(
            self.at,
            (cy * cp, sy * cp, -sp),
            (cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
            (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
        )


@dataclass(frozen=True, eq=False)
class StandingArm:
    """A further arm on the same body, which stands in one posture.

    Attributes:
        model: the arm.
        mount: its place.
        posture: position of each of its joints (n,), rad or m.
        tolerance: greatest deviation of each joint from there (n,), rad or m.
    """

    model: RobotModel
    mount: ArmMount
    posture: JointVector
    tolerance: JointVector


@dataclass(frozen=True, eq=False)
class RobotModel:
    """An arm with its hand. Models are equal if they are the same object.

    Attributes:
        name: name of the robot.
        description: for people.
        body: chain, enclosing balls and hulls, as motions are decided with; those of standing arms come last.
        capsules: the links as capsules, those of standing arms last.
        limits: of the joints.
        tool_limits: of the tool centre point.
        hand: the gripper.
        postures: postures that inverse kinematics uses.
        servos: settings of the servos.
        dynamics: masses and friction.
        licence: licence and origin of the shapes, as text.
        stock_urdf: URDF for PyBullet; None if one is made from hulls and masses.
        meshes: URDF whose visible meshes viewers show; None for the hulls.
        standing_arms: further arms on the same body.
    """

    name: str
    description: str
    body: RobotBody
    capsules: tuple[Capsule, ...]
    limits: JointLimits
    tool_limits: ToolPointLimits
    hand: HandMount
    postures: Postures
    servos: ServoSettings
    dynamics: Dynamics
    licence: str = ""
    stock_urdf: StockUrdf | None = None
    meshes: StockUrdf | None = None
    standing_arms: tuple[StandingArm, ...] = ()

    @property
    def own_links(self) -> tuple[str, ...]:
        """Names of the links of the arm that moves, from the base outwards."""
        return links_of(self.joint_count)

    @property
    def joint_count(self) -> int:
        """Number of the arm's joints, n."""
        return len(self.body.dh_rows)

    @cached_property
    def mountings(self) -> tuple[Mounting, ...]:
        """Constants of each joint's transform."""
        return tuple(mounting_of(row) for row in self.body.dh_rows)

    @cached_property
    def twists(self) -> tuple[Vector, Vector]:
        """Cosine and sine of each joint's twist, each (n, 1)."""
        twists = tuple(row[1] for row in self.body.dh_rows)
        return np.cos(twists)[:, None], np.sin(twists)[:, None]

    @cached_property
    def slides(self) -> Vector:
        """1.0 for each prismatic joint, 0.0 for each revolute joint (n,)."""
        return np.array([float(is_prismatic(row)) for row in self.body.dh_rows])

    @cached_property
    def zero_angles(self) -> Vector:
        """Angle theta of each joint at its position 0 (n, 1), rad."""
        return np.array([[zero_angle(row)] for row in self.body.dh_rows])

    @cached_property
    def joint_origins(self) -> Vector:
        """Each joint's origin in the frame before it, at its position 0 (n, 1, 3, 1), m."""
        lengths, offsets = ([row[number] for row in self.body.dh_rows] for number in (0, 2))
        cosines, sines = self.twists
        origins = np.stack((lengths, -sines[:, 0] * offsets, cosines[:, 0] * offsets), axis=1)
        return origins[:, None, :, None]

    @cached_property
    def all_turn(self) -> bool:
        """True if no joint is prismatic."""
        return not self.slides.any()

    @cached_property
    def servo_shares(self) -> Vector:
        """Share of each joint in the correction of a pose at a tick (n,): w⁻² of a joint of weight w.

        The weight is that of `lean_weights`, at least 1, and ten times it for a prismatic joint: 1 m counts
        as 10 rad.
        """
        weights: Vector = np.maximum(self.postures.lean_weights, 1.0) * (1.0 + 9.0 * self.slides)
        return weights**-2.0

    @cached_property
    def turning_ends(self) -> tuple[int, int]:
        """Numbers of the first and the last revolute joint, counted from 0: for a bearing and a yaw."""
        turning = np.flatnonzero(self.slides == 0.0)
        return int(turning[0]), int(turning[-1])

    @cached_property
    def lowest_solution(self) -> Vector:
        """Lowest joint positions that inverse kinematics gives (n,), rad or m."""
        return self.limits.lowest + _LIMIT_MARGIN

    @cached_property
    def highest_solution(self) -> Vector:
        """Highest joint positions that inverse kinematics gives (n,), rad or m."""
        return self.limits.highest - _LIMIT_MARGIN

    @cached_property
    def ready_levers(self) -> tuple[float, ...]:
        """Levers in the ready posture, as `levers_at` has them; other postures may have longer ones."""
        return self.levers_at(self.postures.ready.tolist())

    def levers_at(self, joints: Sequence[float]) -> tuple[float, ...]:
        """Compute the greatest distance of a link from each axis in one posture.

        Args:
            joints: joint positions (n,), rad or m.

        Returns:
            Distances (n,), m; 1 for a prismatic joint.
        """
        frames, levers = frames_of(self.mountings, list(joints)), [0.0] * self.joint_count
        for hull in self.body.hulls:
            for corner in map(frames[hull.joint].to_base, hull.corners):
                for joint in range(hull.joint):
                    moved = point_derivative(frames[joint + 1], self.mountings[joint], corner)
                    levers[joint] = max(levers[joint], hypot(*moved))
        return tuple(levers)

    @cached_property
    def hand_rotation(self) -> Vector:
        """Rotation of the hand in the last joint's frame (3, 3)."""
        c, s = np.cos(self.hand.turn), np.sin(self.hand.turn)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

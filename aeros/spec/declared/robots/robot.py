"""Schema of a robot file, unresolved: an arm with its hand as data.

Numbers with units are still text; `aeros.sim.robot.robot_file` gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import Identifier
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import IntegerField, LengthBounds, NumberField, TextField

Point = Annotated[tuple[NumberField, ...], LengthBounds(3, 3)]


@dataclass(frozen=True)
class Column:
    """One number for each joint, from the base outwards.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    unit: TextField = field(metadata={"doc": "the unit of `values`, as in `unit: rad/s`"})
    values: tuple[NumberField, ...] = field(metadata={"doc": "one number for each joint"})
    prismatic_unit: TextField | None = field(
        default=None,
        metadata={
            "doc": "the unit of the values of prismatic joints, as in `prismatic_unit: m/s`; required if the "
            "chain has one"
        },
    )
    source: TextField | None = field(default=None, metadata={"doc": "the source of the numbers"})


@dataclass(frozen=True)
class ChainRow:
    """Modified (Craig) Denavit–Hartenberg parameters of one joint.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    length: NumberField = field(metadata={"doc": "a, m"})
    twist: NumberField = field(metadata={"doc": "alpha, rad"})
    offset: NumberField = field(metadata={"doc": "d, m"})
    zero: NumberField | None = field(
        default=None, metadata={"doc": "theta at the joint's position 0, rad; 0 if it is left out"}
    )
    joint: Literal["revolute", "prismatic"] | None = field(
        default=None,
        metadata={
            "doc": "`joint: prismatic` for a joint that slides along its z, so that its position adds to d; "
            "if it is left out, the joint is revolute"
        },
    )


@dataclass(frozen=True)
class Limits:
    """Official limits of the joints.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    lowest: Column = field(metadata={"doc": "lowest positions"})
    highest: Column = field(metadata={"doc": "highest positions"})
    speed: Column = field(metadata={"doc": "greatest speeds"})
    acceleration: Column = field(metadata={"doc": "greatest accelerations"})
    jerk: Column = field(metadata={"doc": "greatest jerks"})
    torque: Column = field(metadata={"doc": "greatest torques"})
    torque_rate: Column = field(metadata={"doc": "greatest changes of torque"})


@dataclass(frozen=True)
class Tool:
    """Limits of the tool centre point.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    speed: TextField = field(metadata={"doc": "greatest speed, as in `speed: 1.7 m/s`"})
    acceleration: TextField = field(metadata={"doc": "greatest acceleration"})
    jerk: TextField = field(metadata={"doc": "greatest jerk"})
    turning_speed: TextField = field(metadata={"doc": "greatest rotational speed"})
    turning_acceleration: TextField = field(metadata={"doc": "greatest rotational acceleration"})
    turning_jerk: TextField = field(metadata={"doc": "greatest rotational jerk"})
    source: TextField | None = field(default=None, metadata={"doc": "the source of the numbers"})


@dataclass(frozen=True)
class Link:
    """Mass of a moving link, or of a palm.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    mass: NumberField = field(metadata={"doc": "kg"})
    centre: Point = field(
        metadata={
            "doc": "centre of mass in the frame of the link's joint, m; of a palm in the frame of the hand"
        }
    )
    inertia: Annotated[tuple[NumberField, ...], LengthBounds(6, 6)] = field(
        metadata={"doc": "xx, yy, zz, xy, xz and yz about the centre of mass, kg·m²"}
    )


@dataclass(frozen=True)
class FingerBox:
    """A box of a finger.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    edges: Point = field(metadata={"doc": "its lengths along x, y and z of the hand, m"})
    at: Point = field(metadata={"doc": "its middle in the frame of the hand, m, with the fingers closed"})


@dataclass(frozen=True)
class Finger:
    """The finger on the side of the hand's +y; the other one is the same, turned by 180 degrees about z.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    mass: NumberField = field(metadata={"doc": "kg"})
    boxes: Annotated[tuple[FingerBox, ...], LengthBounds(1, 12)] = field(
        metadata={"doc": "boxes that the finger consists of; the pads of closed fingers meet at y = 0"}
    )


@dataclass(frozen=True)
class Hand:
    """The gripper and its mounting.

    The frame of the hand has its origin on the flange, z along the last joint's axis, and y along the way of
    the fingers.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    model: Literal["franka_hand", "two_fingers"] = field(
        metadata={
            "doc": "the gripper: `franka_hand`, whose shapes and masses simulators have, or `two_fingers`, "
            "another one whose fingers move in parallel, with `palm` and `finger`"
        }
    )
    flange: TextField = field(
        metadata={"doc": "distance of the flange from the last joint's frame, along its axis"}
    )
    turn: TextField = field(metadata={"doc": "angle by which it is mounted turned about that axis"})
    tool: TextField = field(metadata={"doc": "distance of the tool centre point from the flange"})
    widest_gap: TextField = field(metadata={"doc": "widest distance between the finger pads"})
    finger_speed: TextField = field(metadata={"doc": "greatest speed of one finger"})
    greatest_force: TextField = field(metadata={"doc": "greatest continuous grip force"})
    palm: Link | None = field(
        default=None,
        metadata={
            "doc": "mass of a `two_fingers` hand without its fingers, `centre` in the frame of the hand; its "
            "shape is the hull of `hand`"
        },
    )
    finger: Finger | None = field(default=None, metadata={"doc": "a finger of a `two_fingers` hand"})
    source: TextField | None = field(default=None, metadata={"doc": "the source of the numbers"})


@dataclass(frozen=True)
class Postures:
    """Postures that inverse kinematics uses.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    ready: Column = field(metadata={"doc": "the posture in which it starts; the tool points down, yaw 0"})
    lean: tuple[NumberField, ...] = field(
        metadata={
            "doc": "weight with which each joint is drawn to `ready`; 0 for joints that follow the target's "
            "bearing and yaw"
        }
    )
    search: tuple[tuple[NumberField, ...], ...] = field(
        default=(),
        metadata={"doc": "differences from `ready`, rad or m, at which to search for further solutions"},
    )


@dataclass(frozen=True)
class Servos:
    """Settings of the simulated servos, and of the estimate of contact forces.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    correction: Column = field(
        metadata={"doc": "greatest torque by which a servo corrects the modelled torque"}
    )
    stiffness: Column = field(metadata={"doc": "gains on MuJoCo, in Nm/rad, of prismatic joints in N/m"})
    damping: Column = field(metadata={"doc": "gains on MuJoCo, in Nm*s/rad, of prismatic joints in N*s/m"})
    felt_torque: Column = field(
        metadata={"doc": "external torques below which a joint is not known to feel a contact"}
    )


@dataclass(frozen=True)
class Dynamics:
    """Masses of the moving links, and what the joints add.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    armature: NumberField = field(
        metadata={"doc": "inertia of a motor at its joint, kg·m²; of a prismatic joint kg"}
    )
    damping: NumberField = field(
        metadata={"doc": "viscous friction of a joint, N·m·s/rad; of a prismatic joint N·s/m"}
    )
    dry_friction: NumberField = field(
        metadata={"doc": "dry friction of a joint, N·m; of a prismatic joint N"}
    )
    links: tuple[Link, ...] = field(metadata={"doc": "of each moving link, from the base outwards"})
    source: TextField | None = field(default=None, metadata={"doc": "the source of the numbers"})


@dataclass(frozen=True)
class Capsule:
    """All points within a radius of a segment; it encloses a link.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    link: Identifier = field(metadata={"doc": "the link: `foot`, `link1` and so on, `hand` or `fingers`"})
    joint: IntegerField = field(metadata={"doc": "number of joints that move it; 0 for the foot"})
    a: Point = field(metadata={"doc": "one end of the segment, in the frame of that joint, m"})
    b: Point = field(metadata={"doc": "the other end, m"})
    radius: NumberField = field(metadata={"doc": "m"})


@dataclass(frozen=True)
class Urdf:
    """A URDF that comes with PyBullet.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    path: TextField = field(metadata={"doc": "its path in PyBullet's data"})
    base: TextField = field(metadata={"doc": "the name of its base link"})
    joints: tuple[TextField, ...] = field(metadata={"doc": "the names of the arm's joints"})


@dataclass(frozen=True)
class StandingArm:
    """A further arm on the same body, which stands in one posture while the other one moves.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    prefix: Identifier = field(
        metadata={"doc": "prefix of its links' names, `left_link1` and so on, as in `prefix: left_`"}
    )
    robot: TextField = field(
        metadata={
            "doc": "the arm: a path relative to this file, or the name of a robot that comes with AEROS or "
            "an installed distribution, as in `robot: panda`"
        }
    )
    at: Point = field(
        metadata={
            "doc": "position of its base in the frame of what carries it, m, as in `at: [0.0, 0.5, 0.0]`"
        }
    )
    posture: Column = field(metadata={"doc": "positions of its joints"})
    tolerance: Column = field(
        metadata={
            "doc": "greatest deviation of each joint from `posture` while the other arm moves, 0 or more: "
            "what its brakes, or a controller that holds it, ensure"
        }
    )
    roll_pitch_yaw: Point | None = field(
        default=None,
        metadata={
            "doc": "orientation of its base there, about fixed axes, rad, as in "
            "`roll_pitch_yaw: [0, 0, 1.57]`; 0 if it is left out"
        },
    )
    joint: IntegerField | None = field(
        default=None,
        metadata={
            "doc": "number of the moving arm's joints that carry it, as in `joint: 1`; 0, or left out, if "
            "both stand on one base"
        },
    )


@dataclass(frozen=True)
class Robot:
    """A whole robot file.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/robot/1"] = field(metadata={"doc": "`schema: aeros/robot/1`"})
    id: Identifier = field(metadata={"doc": "the robot's name"})
    description: TextField = field(metadata={"doc": "the robot, for people"})
    licence: TextField = field(metadata={"doc": "licence and origin of the shapes and masses"})
    chain: Annotated[tuple[ChainRow, ...], LengthBounds(4, 12)] = field(
        metadata={"doc": "the chain of joints, from the base outwards"}
    )
    limits: Limits = field(metadata={"doc": "the official limits of the joints"})
    tool: Tool = field(metadata={"doc": "the limits of the tool centre point"})
    hand: Hand = field(metadata={"doc": "the gripper and its mounting"})
    postures: Postures = field(metadata={"doc": "postures that inverse kinematics uses"})
    servos: Servos = field(metadata={"doc": "settings of the simulated servos"})
    dynamics: Dynamics = field(metadata={"doc": "masses of the links"})
    capsules: tuple[Capsule, ...] = field(metadata={"doc": "capsules that enclose the links"})
    hulls: TextField = field(
        metadata={
            "doc": "the file with the links' hulls, next to this file, as in `hulls: my_arm_hulls.json`"
        }
    )
    urdf: Urdf | None = field(
        default=None,
        metadata={"doc": "a URDF of arm and hand for PyBullet; if absent, one is made from hulls and masses"},
    )
    meshes: Urdf | None = field(
        default=None,
        metadata={"doc": "a URDF whose visible meshes viewers show; if absent, that of `urdf`, or the hulls"},
    )
    standing_arms: Annotated[tuple[StandingArm, ...], LengthBounds(0, 8)] = field(
        default=(), metadata={"doc": "further arms on the same body, which stand while this one moves"}
    )

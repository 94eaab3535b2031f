"""A robot as links, joints, shapes and masses, from its numbers alone: no file of a model is needed.

The hand's masses are those of the model `franka_emika_panda` in MuJoCo Menagerie at 1b428b0 (Apache-2.0, from
franka_ros, Apache-2.0).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from math import cos, pi, sin
from typing import Final

import numpy as np

from aeros.kinematic_chain import is_prismatic, zero_angle
from aeros.sim.geometry import UPRIGHT, Pose, Vector3, add
from aeros.sim.mujoco.plans import (
    AT_ORIGIN,
    Friction,
    Inertia,
    JointPlan,
    LinkPlan,
    ShapePlan,
    inertia_of_shapes,
)
from aeros.sim.pictures.urdf_model import roll_pitch_yaw
from aeros.sim.robot.model import HandMount, LinkMass, RobotModel, StandingArm, TwoFingers
from aeros.sim.robot.robot import CARRIAGE_EDGES, RobotOptions
from aeros.sim.robot.standing_arms.standing_arm import fixed_in_posture

FINGERS: Final = ("left_finger", "right_finger")
CARRIAGE_JOINTS: Final = ("carriage_x", "carriage_y")

_FINGER_ARMATURE: Final = 0.1
"""Inertia of the motor of a finger, kg; chosen."""

_FINGER_DAMPING: Final = 10.0
"""Viscous friction of a finger, N·s/m; chosen: 0.5 N at its greatest speed."""

_LINK_FRICTION: Final = Friction(0.5)
"""Friction of all links but the fingers, as PyBullet takes it where nothing is declared."""

_PAD: Final = Friction(1.0)

_HAND: Final = Inertia(0.73, (-0.01, 0.0, 0.03), np.diag((0.001, 0.0025, 0.0017)))

_FINGER: Final = Inertia(0.015, (0.0, 0.0, 0.0), np.diag((2.375e-6, 2.375e-6, 7.5e-7)))

_FINGER_BASE: Final = 0.0584
"""Distance of the fingers' frames from the hand's, along its axis, m: as in franka_description."""

_FINGER_SHAPES: Final = (
    ShapePlan("box", (0.0174, 0.0143, 0.0176), Pose((0.0, 0.00715, 0.045), UPRIGHT)),
    ShapePlan(
        "hull",
        (0.0, 0.0, 0.0),
        corners=tuple(
            (side * x, y, z)
            for x, y, z in (
                (0.0087, 0.0, 0.0362),
                (0.0087, 0.0143, 0.0362),
                (0.0105, 0.0151, 0.0188),
                (0.0105, 0.0253, 0.0188),
            )
            for side in (-1.0, 1.0)
        ),
    ),
    ShapePlan("box", (0.021, 0.0239, 0.0188), Pose((0.0, 0.01445, 0.0094), UPRIGHT)),
)
"""Pad, neck and base of a finger, measured in the mesh of franka_description, m; pads meet at y = 0."""

_CARRIAGE_MASS: Final = 55.0
_SLIDER_MASS: Final = 5.0
"""Masses of the carriage and of what slides under it, kg, as on PyBullet."""


def arm_joints(model: RobotModel) -> tuple[str, ...]:
    """Name the joints of an arm.

    Args:
        model: the robot.

    Returns:
        Their names in the plan, from the base outwards.
    """
    return tuple(f"joint{number}" for number in range(1, model.joint_count + 1))


def plan_robot(options: RobotOptions) -> tuple[LinkPlan, ...]:
    """Describe the robot.

    Args:
        options: carriage, base position, initial posture and friction.

    Returns:
        Its links, the base first, whose frame is B at the start.
    """
    model = options.model
    arm, hand = _arm(model, options.carriage), _hand(model, options.finger_friction)
    standing = chain.from_iterable(map(_standing, model.standing_arms))
    return (*_carriage(options.carriage), *arm, *hand, *standing)


def hull_of_link(link: str) -> str:
    """Name the hull that holds a link of the plan.

    Args:
        link: name of a link of an arm.

    Returns:
        The name of the hull; both fingers of a hand have one.
    """
    for finger in FINGERS:
        if link.endswith(finger):
            return f"{link.removesuffix(finger)}fingers"
    return link


def _standing(arm: StandingArm) -> Iterator[LinkPlan]:
    """Yield the links of a standing arm, fixed where they stand, fingers closed."""
    mount = arm.mount
    carrier = f"link{mount.joint}" if mount.joint else "foot"
    for link in plan_robot(RobotOptions(fixed_in_posture(arm))):
        name = f"{mount.prefix}{link.name}"
        if link.parent is None:
            place = Pose(mount.at, roll_pitch_yaw(*mount.roll_pitch_yaw))
            yield link._replace(name=name, parent=carrier, place=place)
        else:
            yield link._replace(name=name, parent=f"{mount.prefix}{link.parent}", joint=None)


def _carriage(drives: bool) -> Iterator[LinkPlan]:
    if not drives:
        return
    edges = CARRIAGE_EDGES
    box = ShapePlan("box", edges, Pose((0.0, 0.0, -edges[2] / 2.0), UPRIGHT))
    slider = Inertia(_SLIDER_MASS, (0.0, 0.0, 0.0), np.eye(3))
    carriage = inertia_of_shapes(_CARRIAGE_MASS, (box._replace(place=AT_ORIGIN),))
    carriage = carriage._replace(centre=box.place.position)
    x, y = (JointPlan(name, True, axis) for name, axis in zip(CARRIAGE_JOINTS, _LEVEL_AXES, strict=True))
    yield LinkPlan("rail", None, AT_ORIGIN, None, None, (), _LINK_FRICTION)
    yield LinkPlan("slider", "rail", AT_ORIGIN, x, slider, (), _LINK_FRICTION)
    yield LinkPlan("carriage", "slider", AT_ORIGIN, y, carriage, (box,), _LINK_FRICTION)


def _arm(model: RobotModel, drives: bool) -> Iterator[LinkPlan]:
    foot = _hull_of(model, "foot")
    yield LinkPlan("foot", "carriage" if drives else None, AT_ORIGIN, None, None, foot, _LINK_FRICTION)
    parent, dynamics, limits = "foot", model.dynamics, model.limits
    rows = zip(model.body.dh_rows, dynamics.links, arm_joints(model), strict=True)
    for number, (row, masses, joint_name) in enumerate(rows, 1):
        name = f"link{number}"
        length, twist, offset, *_ = row
        zero = zero_angle(row)
        # Modified Denavit–Hartenberg: turn by the twist about x after a step along x, then along and about z.
        place = Pose(
            (length, -sin(twist) * offset, cos(twist) * offset),
            (
                sin(twist / 2.0) * cos(zero / 2.0),
                -sin(twist / 2.0) * sin(zero / 2.0),
                cos(twist / 2.0) * sin(zero / 2.0),
                cos(twist / 2.0) * cos(zero / 2.0),
            ),
        )
        joint = JointPlan(
            joint_name,
            is_prismatic(row),
            (0.0, 0.0, 1.0),
            (float(limits.lowest[number - 1]), float(limits.highest[number - 1])),
            dynamics.dry_friction,
            dynamics.damping,
            dynamics.armature,
        )
        yield LinkPlan(name, parent, place, joint, _inertia_of(masses), _hull_of(model, name), _LINK_FRICTION)
        parent = name


def _hand(model: RobotModel, friction: float) -> Iterator[LinkPlan]:
    last, hull = f"link{model.joint_count}", _hull_in_hand(model)
    palm, finger, shapes, base = _gripper_parts(model.hand.gripper)
    yield LinkPlan("hand", last, _mounted(model.hand), None, palm, hull, _LINK_FRICTION)
    for name, turn in zip(FINGERS, (0.0, pi), strict=True):
        place = Pose((0.0, 0.0, base), (0.0, 0.0, sin(turn / 2.0), cos(turn / 2.0)))
        joint = JointPlan(
            f"{name}_joint",
            True,
            (0.0, 1.0, 0.0),
            (0.0, model.hand.widest_gap / 2.0),
            damping=_FINGER_DAMPING,
            armature=_FINGER_ARMATURE,
        )
        yield LinkPlan(name, "hand", place, joint, finger, shapes, _PAD._replace(lateral=friction))


def _gripper_parts(gripper: TwoFingers | None) -> tuple[Inertia, Inertia, tuple[ShapePlan, ...], float]:
    """Return the palm's mass, a finger's mass and shapes, and the height of the finger's frame, m."""
    if gripper is None:
        return _HAND, _FINGER, _FINGER_SHAPES, _FINGER_BASE
    shapes = tuple(ShapePlan("box", edges, Pose(middle, UPRIGHT)) for edges, middle in gripper.boxes)
    volumes = [shape.volume for shape in shapes]
    x, y, z = (
        sum(share * shape.place.position[axis] for share, shape in zip(volumes, shapes, strict=True))
        / sum(volumes)
        for axis in range(3)
    )
    around = [one._replace(place=Pose(add(one.place.position, (-x, -y, -z)), UPRIGHT)) for one in shapes]
    finger = inertia_of_shapes(gripper.finger_mass, around)._replace(centre=(x, y, z))
    return _inertia_of(gripper.palm), finger, shapes, 0.0


def _inertia_of(link: LinkMass) -> Inertia:
    xx, yy, zz, xy, xz, yz = link.inertia
    return Inertia(link.mass, link.centre, np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))))


def _hull_of(model: RobotModel, link: str) -> tuple[ShapePlan, ...]:
    return tuple(
        ShapePlan("hull", (0.0, 0.0, 0.0), corners=tuple(one.corners), margin=one.radius)
        for one in model.body.hulls
        if one.link == link
    )


def _hull_in_hand(model: RobotModel) -> tuple[ShapePlan, ...]:
    """Return the hull of the hand, whose corners are in the frame of the last joint, in the hand's."""
    return tuple(
        shape._replace(corners=tuple(map(model.hand.from_last_joint, shape.corners)))
        for shape in _hull_of(model, "hand")
    )


_LEVEL_AXES: Final[tuple[Vector3, Vector3]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


def _mounted(hand: HandMount) -> Pose:
    """Return the pose of the hand in the frame of the last joint: beyond the flange, turned about it."""
    return Pose((0.0, 0.0, hand.flange), (0.0, 0.0, sin(hand.turn / 2.0), cos(hand.turn / 2.0)))

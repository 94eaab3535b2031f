"""The Panda as links, joints, shapes and masses, from numbers alone: no file of a model is needed.

Chain and hulls are those of `aeros.sim.robot.body`. Masses, inertias, armature and damping are those of the
model `franka_emika_panda` in MuJoCo Menagerie at 1b428b0 (Apache-2.0, from franka_ros, Apache-2.0), which
has them from identification: C. Gaz, M. Cognetti, A. Oliva, P. Robuffo Giordano, A. De Luca, Dynamic
Identification of the Franka Emika Panda Robot With Retrieval of Feasible Parameters Using Penalty-Based
Optimization, IEEE Robotics and Automation Letters 4 (2019).
"""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, sin
from typing import Final

import numpy as np

from aeros.sim.geometry import UPRIGHT, Pose, Vector3
from aeros.sim.mujoco.plans import (
    AT_ORIGIN,
    Friction,
    Inertia,
    JointPlan,
    LinkPlan,
    ShapePlan,
    inertia_of_shapes,
)
from aeros.sim.robot.body import PANDA_BODY
from aeros.sim.robot.kinematics import FLANGE
from aeros.sim.robot.limits import FINGER_GAP_MAX, Q_MAX, Q_MIN
from aeros.sim.robot.robot import CARRIAGE_EDGES, RobotOptions

ARM_JOINTS: Final = tuple(f"joint{number}" for number in range(1, 8))
FINGERS: Final = ("left_finger", "right_finger")
CARRIAGE_JOINTS: Final = ("carriage_x", "carriage_y")

_ARMATURE: Final = 0.1
"""Inertia of a motor of the arm at its joint, kg·m²."""

_DAMPING: Final = 1.0
"""Viscous friction of a joint of the arm, N·m·s/rad."""

_DRY_FRICTION: Final = 0.2
"""Dry friction of a joint of the arm, N·m; chosen."""

_FINGER_ARMATURE: Final = 0.1
"""Inertia of the motor of a finger, kg; chosen."""

_FINGER_DAMPING: Final = 10.0
"""Viscous friction of a finger, N·s/m; chosen: 0.5 N at its greatest speed."""

_LINK_FRICTION: Final = Friction(0.5)
"""Friction of all links but the fingers, as PyBullet takes it where nothing is declared."""

_PAD: Final = Friction(1.0)

_MASSES: Final[tuple[tuple[float, Vector3, tuple[float, ...]], ...]] = (
    (4.970684, (0.003875, 0.002081, -0.04762),
     (0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169)),
    (0.646926, (-0.003141, -0.02872, 0.003495),
     (0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704)),
    (3.228604, (0.027518, 0.039252, -0.066502),
     (0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805)),
    (3.587895, (-0.05317, 0.104419, 0.027454),
     (0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641)),
    (1.225946, (-0.011953, 0.041065, -0.038437),
     (0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229)),
    (1.666555, (0.060149, -0.014117, -0.010517),
     (0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341)),
    (0.735522, (0.010517, -0.004252, 0.061597),
     (0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741)),
)  # fmt: skip
"""Of each link from 1 to 7: mass, kg; centre of mass, m; and xx, yy, zz, xy, xz, yz about it, kg·m²."""

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


def plan_panda(options: RobotOptions) -> tuple[LinkPlan, ...]:
    """Describe the robot.

    Args:
        options: carriage, base position, initial posture and friction.

    Returns:
        Its links, the base first, whose frame is B at the start.
    """
    return (*_carriage(options.carriage), *_arm(options.carriage), *_hand(options.finger_friction))


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


def _arm(drives: bool) -> Iterator[LinkPlan]:
    yield LinkPlan(
        "foot", "carriage" if drives else None, AT_ORIGIN, None, None, _hull_of("foot"), _LINK_FRICTION
    )
    parent = "foot"
    for number, (row, masses) in enumerate(zip(PANDA_BODY.dh_rows, _MASSES, strict=True), 1):
        name, (mass, centre, (xx, yy, zz, xy, xz, yz)) = f"link{number}", masses
        length, twist, offset = row
        # Modified Denavit–Hartenberg: turn by the twist about x, after a step along x, then along z.
        place = Pose(
            (length, -sin(twist) * offset, cos(twist) * offset),
            (sin(twist / 2.0), 0.0, 0.0, cos(twist / 2.0)),
        )
        limits = (float(Q_MIN[number - 1]), float(Q_MAX[number - 1]))
        joint = JointPlan(
            ARM_JOINTS[number - 1], False, (0.0, 0.0, 1.0), limits, _DRY_FRICTION, _DAMPING, _ARMATURE
        )
        matrix = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
        yield LinkPlan(
            name, parent, place, joint, Inertia(mass, centre, matrix), _hull_of(name), _LINK_FRICTION
        )
        parent = name


def _hand(friction: float) -> Iterator[LinkPlan]:
    yield LinkPlan("hand", "link7", _MOUNTED, None, _HAND, _hull_in_hand(), _LINK_FRICTION)
    for name, turn in zip(FINGERS, (0.0, pi), strict=True):
        place = Pose((0.0, 0.0, _FINGER_BASE), (0.0, 0.0, sin(turn / 2.0), cos(turn / 2.0)))
        joint = JointPlan(
            f"{name}_joint",
            True,
            (0.0, 1.0, 0.0),
            (0.0, FINGER_GAP_MAX / 2.0),
            damping=_FINGER_DAMPING,
            armature=_FINGER_ARMATURE,
        )
        yield LinkPlan(name, "hand", place, joint, _FINGER, _FINGER_SHAPES, _PAD._replace(lateral=friction))


def _hull_of(link: str) -> tuple[ShapePlan, ...]:
    return tuple(
        ShapePlan("hull", (0.0, 0.0, 0.0), corners=tuple(one.corners), margin=one.radius)
        for one in PANDA_BODY.hulls
        if one.link == link
    )


def _hull_in_hand() -> tuple[ShapePlan, ...]:
    """Return the hull of the hand, whose corners are in the frame of the last joint, in the hand's."""
    c = cos(pi / 4.0)
    return tuple(
        shape._replace(corners=tuple((c * (x - y), c * (x + y), z - FLANGE) for x, y, z in shape.corners))
        for shape in _hull_of("hand")
    )


_LEVEL_AXES: Final[tuple[Vector3, Vector3]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
_MOUNTED: Final = Pose((0.0, 0.0, FLANGE), (0.0, 0.0, sin(-pi / 8.0), cos(pi / 8.0)))
"""Pose of the hand in the frame of the last joint: beyond the flange, turned by −45°."""

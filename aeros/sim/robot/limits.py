"""Limits of a robot's joints, of its tool and of its hand, SI, as its robot file states them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of the joints, from the base outwards; each (n,), read-only.

    Units are those of revolute joints; of prismatic joints m replaces rad, and N replaces N·m.

    Attributes:
        lowest: lowest positions, rad.
        highest: highest positions, rad.
        speed: greatest speeds, rad/s.
        acceleration: greatest accelerations, rad/s².
        jerk: greatest jerks, rad/s³.
        torque: greatest torques, N·m.
        torque_rate: greatest changes of torque, N·m/s.
    """

    lowest: Vector
    highest: Vector
    speed: Vector
    acceleration: Vector
    jerk: Vector
    torque: Vector
    torque_rate: Vector

    def __post_init__(self) -> None:
        for column in vars(self).values():
            column.flags.writeable = False


@dataclass(frozen=True)
class ToolPointLimits:
    """Limits of the tool centre point.

    Attributes:
        speed: greatest speed, m/s.
        acceleration: greatest acceleration, m/s².
        jerk: greatest jerk, m/s³.
        turning_speed: greatest rotational speed, rad/s.
        turning_acceleration: greatest rotational acceleration, rad/s².
        turning_jerk: greatest rotational jerk, rad/s³.
    """

    speed: float
    acceleration: float
    jerk: float
    turning_speed: float
    turning_acceleration: float
    turning_jerk: float


SCANNER_RANGE: Final = 20.0
"""Reading of the area scanner when nobody is in range, m."""

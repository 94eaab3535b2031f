"""The Panda's official limits, per joint 1 to 7, SI.

Source: frankaemika/docs at 1da6bd3, `control_parameters`. PyBullet's own panda.urdf is wider on every
joint; it is never read for limits.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def _per_joint(*values: float) -> Vector:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


Q_MIN: Final = _per_joint(-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)
"""Lowest joint positions, rad."""

Q_MAX: Final = _per_joint(2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)
"""Highest joint positions, rad."""

QD_MAX: Final = _per_joint(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61)
"""Greatest joint speeds, rad/s."""

QDD_MAX: Final = _per_joint(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0)
"""Greatest joint accelerations, rad/s²."""

QDDD_MAX: Final = _per_joint(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0)
"""Greatest joint jerks, rad/s³."""

TAU_MAX: Final = _per_joint(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)
"""Greatest joint torques, N·m."""

TOOL_SPEED_MAX: Final = 1.7
"""Greatest speed of the tool centre point, m/s."""

TOOL_ACCELERATION_MAX: Final = 13.0
"""Greatest acceleration of the tool centre point, m/s²."""

YAW_SPEED_MAX: Final = 2.5
"""Greatest rotational speed of the tool, rad/s."""

TURNING_ACCELERATION_MAX: Final = 25.0
"""Greatest rotational acceleration of the tool, rad/s²."""

FINGER_GAP_MAX: Final = 0.08
"""Widest distance between the finger pads, m (Franka Hand: 80 mm stroke)."""

FINGER_SPEED: Final = 0.05
"""Greatest speed of one finger, m/s (Franka Hand: 50 mm/s)."""

GRIP_FORCE_MAX: Final = 70.0
"""Greatest continuous grip force, N (Franka Hand)."""

SCANNER_RANGE: Final = 20.0
"""Reading of the area scanner when nobody is in range, m."""

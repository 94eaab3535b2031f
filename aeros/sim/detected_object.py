"""Objects detected in a camera picture."""

from __future__ import annotations

from typing import NamedTuple

from aeros.sim.geometry import Vector3


class Push(NamedTuple):
    """A push by closed fingers that moves a lying object to where a hand has room, in W.

    Attributes:
        start: where the fingers come down, behind the object's end; a hand across its axis is free there,
            m.
        displacement: from the start along the object's axis to where a hand has room, m.
    """

    start: Vector3
    displacement: Vector3


class DetectedObject(NamedTuple):
    """An upright or lying object found in a picture, in W.

    Attributes:
        position: its middle, m.
        axis: heading of its axis if it lies, rad in [-π/2, π/2); None if it stands.
        grip_yaw: heading of a hand that has room to close on it across its axis, rad; None if there is no
            room.
        push: how to make room for a hand around a lying object; None if that is not needed or not possible.
    """

    position: Vector3
    axis: float | None = None
    grip_yaw: float | None = 0.0
    push: Push | None = None

"""What the evaluation of a picture says of one thing."""

from __future__ import annotations

from typing import NamedTuple

from aeros.sim.geometry import Vector3


class Push(NamedTuple):
    """How closed fingers make room for a hand around what lies, in W.

    start: where nothing is in the way of a hand across its axis, behind its end, m.
    way: how far it is pushed along its axis to where a hand has room, m.
    """

    start: Vector3
    displacement: Vector3


class DetectedObject(NamedTuple):
    """What a picture shows of an upright or lying cylinder, in W.

    place: its middle, m.
    axis: heading of its axis where it lies, rad in [-π/2, π/2); None where it stands.
    grip: heading of a hand that has room to close on it across its axis, rad; None where there is no room.
    push: how room for a hand is made where it lies and has none; None where it is not needed or not found.
    """

    position: Vector3
    axis: float | None = None
    grip_yaw: float | None = 0.0
    push: Push | None = None

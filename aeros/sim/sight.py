"""What the evaluation of a picture says of one thing."""

from __future__ import annotations

from typing import NamedTuple

from aeros.sim.geometry import Triple


class Sight(NamedTuple):
    """What a picture shows of an upright or lying cylinder, in W.

    place: its middle, m.
    axis: heading of its axis where it lies, rad in [-π/2, π/2); None where it stands.
    grip: heading of a hand that has room to close on it across its axis, rad; None where there is no room.
    """

    place: Triple
    axis: float | None = None
    grip: float | None = 0.0

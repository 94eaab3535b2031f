"""A table to clean: a dirty area, a sponge at its rest, two pieces of clutter beside the area, a bin."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, dist, pi
from typing import Any, Final, NamedTuple

from aeros.sim.geometry import Camera, Pose, Triple, minus, of_frame, turned, yaw_of
from aeros.sim.randomness import Chance

AREA: Final = ((0.35, -0.15), (0.65, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, m."""

SPONGE: Final = (0.10, 0.07, 0.03)
"""Edges of the sponge's foam, m (models/sponge.urdf)."""

REST: Final = (0.45, 0.34)
"""Nominal middle of the sponge's rest, m."""

BIN: Final = (0.45, -0.50, 0.005)
"""Middle of the bin's floor, m."""

BIN_INNER: Final = (0.18, 0.16, 0.08)
"""Length, width and depth of the bin, m."""

CUBE: Final = 0.04
"""Edge of the first piece of clutter, m."""

CAN: Final = (0.02, 0.05)
"""Radius and height of the second piece of clutter, m."""

CLUTTER: Final = ((0.38, -0.255), (0.56, -0.255))
"""Nominal places of the pieces, m: beside the area, so that wiping may come first, and clear
of the bin by the width of the hand."""

SPREAD: Final = 0.03
"""Clutter and the sponge's rest are up to this far from their nominal places in x and in y, m."""

WIPED: Final = 0.95
"""Share of wiped cells from which the table counts as wiped."""

PRESSING: Final = 1.0
"""Force of the sponge on the table above which it wipes, N."""

RETURNED: Final = 0.03
"""Distance from its rest within which the sponge is at it, m."""

CAMERAS: Final[tuple[str, ...]] = ("mast",)

MAST: Final = Camera(eye=(0.95, -0.05, 1.0), target=(0.45, -0.08, 0.0), field_of_view=55.0)
"""The camera on a mast across the table from the robot: it sees area, rest, bin and the clutter's places,
and an arm that is drawn in hides none of them."""

AT_REST: Final = 0.01
"""Speed below which a thing rests, m/s."""


class Layout(NamedTuple):
    """Where things are at the start: where the sponge belongs, the sponge, cube and can."""

    rest: Triple
    sponge: Pose
    cube: Pose
    can: Pose


def lay_table(chance: Chance) -> Layout:
    """Channels of chance: rest, clutter.  Things begin 1 mm above what they lie on."""
    dx, dy, turn = (float(part) for part in chance.on("rest").uniform(-1.0, 1.0, 3))
    rest = (REST[0] + SPREAD * dx, REST[1] + SPREAD * dy, SPONGE[2] / 2)
    draw = [float(part) for part in chance.on("clutter").uniform(-1.0, 1.0, 5)]
    (x, y), (u, v) = CLUTTER
    cube = (x + SPREAD * draw[0], y + SPREAD * draw[1], CUBE / 2 + 0.001)
    can = (u + SPREAD * draw[3], v + SPREAD * draw[4], CAN[1] / 2 + 0.001)
    return Layout(
        rest,
        Pose((rest[0], rest[1], rest[2] + 0.001), turned(0.1 * turn)),
        Pose(cube, turned(0.5 * draw[2])),
        Pose(can, turned(0.0)),
    )


def measured_on_table(
    rest: Triple, sponge: Pose, clutter: Sequence[Pose], *, wiped: float, let_go: bool
) -> dict[str, Any]:
    """Poses of sponge, clutter and bin, and the task's predicates.

    clutter_position and clutter_yaw are of the first piece outside the bin, absent when there is
    none.  A piece counts until it is in the bin, wherever else it is, and however it fell.
    wiped: share of cells.  let_go: whether the sponge is still and nothing of the robot touches it.
    """
    loose = [pose for pose in clutter if not _in_bin(pose.position)]
    at_rest = dist(sponge.position, rest) < RETURNED and let_go
    values: dict[str, Any] = {
        "sponge_position": sponge.position,
        "sponge_yaw": _half_turn(yaw_of(sponge.orientation)),
        "sponge_rest_position": rest,
        "bin_position": (BIN[0], BIN[1], BIN[2] + BIN_INNER[2]),
        "clutter_on_table": bool(loose),
        "wiping_area_clear": not any(_in_area(pose.position) for pose in loose),
        "wiped_fraction": wiped,
        "table_wiped": wiped >= WIPED,
        "table_organized": not loose and at_rest,
    }
    if loose:
        values["clutter_position"] = loose[0].position
        values["clutter_yaw"] = _grip_yaw(loose[0])
    return values


def _in_bin(place: Triple) -> bool:
    length, width, depth = BIN_INNER
    beside = abs(place[0] - BIN[0]) < length / 2 and abs(place[1] - BIN[1]) < width / 2
    return beside and BIN[2] < place[2] < BIN[2] + depth


def _in_area(place: Triple) -> bool:
    """Whether a piece's middle is where sponge and fingers pass (60 mm around the area)."""
    low, high = AREA
    return all(a - 0.06 < at < b + 0.06 for a, at, b in zip(low, place, high, strict=False))


def _half_turn(yaw: float) -> float:
    """The same heading of a box, in [-π/2, π/2)."""
    return (yaw + pi / 2) % pi - pi / 2


def _grip_yaw(piece: Pose) -> float:
    """A heading at which fingers meet the sides of a cube or a cylinder, however it lies, in [-π/4, π/4).

    A cylinder that stands has sides at every heading; one that lies has them along its axis and across.
    """
    x, y, z = (minus(of_frame(piece, axis), piece.position) for axis in _AXES)
    level = z if abs(z[2]) < _LEVEL else x if abs(x[2]) < abs(y[2]) else y
    return (atan2(level[1], level[0]) + pi / 4) % (pi / 2) - pi / 4


_AXES: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

_LEVEL: Final = 0.7
"""Part of an axis along the vertical below which it lies rather than stands."""

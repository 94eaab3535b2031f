"""Layout of a table to clean: a dirty area, a sponge at its rest, two pieces of clutter next to it, a bin."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera, Pose, Vector3, to_world, yaw_orientation
from aeros.sim.randomness import RandomSource

WIPING_AREA: Final = ((0.35, -0.15), (0.65, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, m."""

SPONGE_SIZE: Final = (0.10, 0.07, 0.03)
"""Edges of the sponge's foam, m (models/sponge.urdf)."""

SPONGE_REST: Final = (0.45, 0.34)
"""Nominal middle of the sponge's rest, m."""

BIN: Final = (0.45, -0.50, 0.005)
"""Middle of the bin's floor, m."""

BIN_INNER: Final = (0.18, 0.16, 0.08)
"""Length, width and depth of the bin, m."""

CUBE_EDGE: Final = 0.04
"""Edge of the first piece of clutter, m."""

CAN_SIZE: Final = (0.02, 0.05)
"""Radius and height of the second piece of clutter, m."""

CLUTTER_POSITIONS: Final = ((0.38, -0.255), (0.56, -0.255))
"""Nominal places of the pieces, m: next to the area, so that wiping may come first, and clear
of the bin by the width of the hand."""

POSITION_SPREAD: Final = 0.03
"""Greatest random offset of clutter and of the sponge's rest, in x and in y, m."""

WIPED_THRESHOLD: Final = 0.95
"""Least share of wiped cells of a wiped table."""

WIPING_FORCE: Final = 1.0
"""Force of the sponge on the table above which it wipes, N."""

REST_TOLERANCE: Final = 0.03
"""Greatest distance of the sponge from its rest at which it counts as returned, m."""

CELL_SIZE: Final = 0.01
"""Edge of a cell, m."""

WIPING_GAP: Final = 0.0015
"""Greatest distance of the wiping face from a cell that it wipes, m."""

CAMERAS: Final[tuple[str, ...]] = ("mast", "overhead")

MAST_CAMERA: Final = Camera(eye=(0.95, -0.05, 1.0), target=(0.45, -0.08, 0.0), field_of_view=55.0)
"""The camera on a mast across the table from the robot: it sees the area, the sponge's rest, the bin and
the clutter; a retracted arm hides none of them."""

OVERHEAD_CAMERA: Final = Camera(
    eye=(0.47, -0.06, 1.45), target=(0.47, -0.06, 0.0), up=(1.0, 0.0, 0.0), field_of_view=36.0
)
"""The camera over the table: its picture is 1.23 m wide and 0.92 m high, 4 mm a pixel."""


class TableLayout(NamedTuple):
    """Initial poses in W.

    Attributes:
        rest: the place where the sponge belongs, m.
        sponge: pose of the sponge.
        cube: pose of the cube.
        can: pose of the can.
    """

    rest: Vector3
    sponge: Pose
    cube: Pose
    can: Pose


def sample_table_layout(chance: RandomSource) -> TableLayout:
    """Draw the initial layout of the table; objects begin 1 mm above it.

    Args:
        chance: random source; channels `rest` and `clutter`.

    Returns:
        The layout, in W.
    """
    dx, dy, turn = (float(part) for part in chance.generator("rest").uniform(-1.0, 1.0, 3))
    rest = (SPONGE_REST[0] + POSITION_SPREAD * dx, SPONGE_REST[1] + POSITION_SPREAD * dy, SPONGE_SIZE[2] / 2)
    draw = [float(part) for part in chance.generator("clutter").uniform(-1.0, 1.0, 5)]
    (x, y), (u, v) = CLUTTER_POSITIONS
    cube = (x + POSITION_SPREAD * draw[0], y + POSITION_SPREAD * draw[1], CUBE_EDGE / 2 + 0.001)
    can = (u + POSITION_SPREAD * draw[3], v + POSITION_SPREAD * draw[4], CAN_SIZE[1] / 2 + 0.001)
    return TableLayout(
        rest,
        Pose((rest[0], rest[1], rest[2] + 0.001), yaw_orientation(0.1 * turn)),
        Pose(cube, yaw_orientation(0.5 * draw[2])),
        Pose(can, yaw_orientation(0.0)),
    )


class DirtMap:
    """Wiped and dirty cells of a rectangle at z = 0 of W, in square cells.

    Args:
        low: corner with the least x and y in W, m.
        high: corner with the greatest x and y in W, m.
    """

    def __init__(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        self._x, self._y = (
            np.arange(a + CELL_SIZE / 2, b, CELL_SIZE) for a, b in zip(low, high, strict=True)
        )
        self.wiped: NDArray[np.bool_] = np.zeros((len(self._y), len(self._x)), dtype=np.bool_)
        """True for wiped cells; rows from the least y, columns from the least x."""

    @property
    def wiped_fraction(self) -> float:
        """Share of wiped cells, in [0, 1]."""
        return int(np.count_nonzero(self.wiped)) / self.wiped.size

    def wipe(self, pose: Pose, size: Vector3) -> None:
        """Wipe the cells whose centres are under a box's bottom face, nearer than `WIPING_GAP`.

        Args:
            pose: of the box's middle in W, within 45° of upright.
            size: length, width and height of the box, m.
        """
        width, depth, height = (edge / 2.0 for edge in size)
        mx, my, mz = to_world(pose, (0.0, 0.0, -height))
        ahead, aside = to_world(pose, (1.0, 0.0, -height)), to_world(pose, (0.0, 1.0, -height))
        ax, ay, az = ahead[0] - mx, ahead[1] - my, ahead[2] - mz
        bx, by, bz = aside[0] - mx, aside[1] - my, aside[2] - mz
        # Coordinates of each cell in the face: the cell is middle + a·ahead + b·aside in x and y.
        x, y, turn = self._x - mx, (self._y - my)[:, None], ax * by - ay * bx
        a = (by / turn) * x - (bx / turn) * y
        b = (ax / turn) * y - (ay / turn) * x
        self.wiped |= (np.abs(a) < width) & (np.abs(b) < depth) & (mz + az * a + bz * b < WIPING_GAP)


def table_measurements(rest: Vector3, wiped: float) -> dict[str, Any]:
    """Return surveyed positions, and the progress of wiping that contact measures.

    Args:
        rest: goal position of the sponge, in W, m.
        wiped: share of wiped cells, in [0, 1].

    Returns:
        Values by vocabulary name, SI, positions in W.
    """
    return {
        "sponge_rest_position": rest,
        "bin_position": (BIN[0], BIN[1], BIN[2] + BIN_INNER[2]),
        "wiped_fraction": wiped,
        "table_wiped": wiped >= WIPED_THRESHOLD,
    }


def table_detections(
    rest: Vector3, sponge: DetectedObject | None, pieces: Sequence[DetectedObject]
) -> dict[str, Any]:
    """Return what a picture from above shows of sponge and clutter.

    `clutter_position` and `clutter_yaw` are of the first piece outside the bin. A piece that the picture
    does not show counts as not on the table.

    Args:
        rest: goal position of the sponge, in W, m.
        sponge: the detected sponge, if any.
        pieces: the detected pieces of clutter.

    Returns:
        Values by vocabulary name, SI, positions in W; None for what the picture does not show.
    """
    loose = [piece for piece in pieces if not _in_bin(piece.position)]
    at_rest = sponge is not None and dist(sponge.position, rest) < REST_TOLERANCE
    return {
        "sponge_seen": sponge is not None,
        "sponge_position": None if sponge is None else sponge.position,
        "sponge_yaw": None if sponge is None else sponge.grip_yaw,
        "clutter_position": loose[0].position if loose else None,
        "clutter_yaw": loose[0].grip_yaw if loose else None,
        "clutter_on_table": bool(loose),
        "wiping_area_clear": not any(_in_area(piece.position) for piece in loose),
        "table_organized": not loose and at_rest,
    }


def _in_bin(place: Vector3) -> bool:
    length, width, depth = BIN_INNER
    is_over_bin = abs(place[0] - BIN[0]) < length / 2 and abs(place[1] - BIN[1]) < width / 2
    return is_over_bin and BIN[2] < place[2] < BIN[2] + depth


def _in_area(place: Vector3) -> bool:
    """Return True if a piece's middle is where sponge and fingers pass (60 mm around the area)."""
    low, high = WIPING_AREA
    return all(a - 0.06 < at < b + 0.06 for a, at, b in zip(low, place, high, strict=False))

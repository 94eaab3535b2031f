"""Meaning of pictures of a table to clean."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist
from typing import Any, Final

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Vector3

WIPING_AREA: Final = ((0.35, -0.15), (0.65, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, m."""

SPONGE_SIZE: Final = (0.10, 0.07, 0.03)
"""Edges of the sponge's foam, m (models/sponge.urdf)."""

BIN: Final = (0.45, -0.50, 0.005)
"""Middle of the bin's floor, m."""

BIN_INNER: Final = (0.18, 0.16, 0.08)
"""Length, width and depth of the bin, m."""

WIPED_THRESHOLD: Final = 0.95
"""Least share of wiped cells of a wiped table."""

REST_TOLERANCE: Final = 0.03
"""Greatest distance of the sponge from its rest at which it counts as returned, m."""

CELL_SIZE: Final = 0.01
"""Edge of a cell, m."""


def table_measurements(wiped: float) -> dict[str, Any]:
    """Return the progress of wiping that contact measures.

    Args:
        wiped: share of wiped cells, in [0, 1].

    Returns:
        Values by vocabulary name, SI, positions in W.
    """
    return {
        "wiped_fraction": wiped,
        "table_wiped": wiped >= WIPED_THRESHOLD,
    }


def table_detections(
    rest: Vector3 | None, sponge: DetectedObject | None, pieces: Sequence[DetectedObject]
) -> dict[str, Any]:
    """Return what a picture from above shows of sponge and clutter.

    `clutter_position` and `clutter_yaw` are of the first piece outside the bin. A piece that the picture
    does not show counts as not on the table.

    Args:
        rest: goal position of the sponge, in W, m; None where the scene has none.
        sponge: the detected sponge, if any.
        pieces: the detected pieces of clutter.

    Returns:
        Values by vocabulary name, SI, positions in W; None for what the picture does not show.
    """
    loose = [piece for piece in pieces if not _in_bin(piece.position)]
    at_rest = sponge is not None and rest is not None and dist(sponge.position, rest) < REST_TOLERANCE
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

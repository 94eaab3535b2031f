"""Checks of the cameras that the robot carries: places by the markers on the robot's own carriage.

A survey reads markers of fixtures with cameras. One that was knocked has every marker elsewhere, and so has
one whose robot does not know exactly where it is. The carriage tells the two apart: its top bears markers
whose places relative to the robot are known, and a camera that shows some of them off is off itself. As for
perceivers (`aeros.runtime.perception.camera_places`), a place lasts until a picture shows another one.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import dist, radians, tan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.own_base import CameraShift
from aeros.sim.geometry import Camera, Vector3, add, camera_axes, subtract

_NEAREST, _FARTHEST = 0.15, 2.5
"""Distances from which a detector sees a marker of 50 mm in 320 x 240 pixels, m."""

_SPOTS: Final = tuple(product(np.linspace(-0.24, 0.24, 13).tolist(), np.linspace(-0.2, 0.2, 11).tolist()))
"""Places of the markers on the carriage's top from the arm's base, x and y, m: every 40 mm one of 30 mm."""

_READ_WITHIN: Final = 1.5
"""Distance from which a marker of 30 mm is read, m: it is as large as one of 50 mm from 2.5 m."""

_PERIOD: Final = 24
"""Ticks from one check of a camera to the next: 0.1 s."""

_NEGLIGIBLE: Final = 0.012
"""Greatest distance, m, by which a camera shows a thing 1 m away elsewhere, and stays where it is declared.
Perceivers have the same."""

_SAME: Final = 0.015
"""Greatest difference of two places of a camera, m at a distance of 1 m, that is of the pictures' noise."""

_LEAST_SPREAD: Final = 0.05
"""Least spread of the shown markers across the way in which they spread most, m, as the root of the sum of
squares: with errors of 0.2 mm the angle about that way is known to 4 mrad."""


class SeeingCamera(NamedTuple):
    """A camera that looks for markers.

    Attributes:
        name: its name.
        camera: where it is, in W.
        believed: where the robot takes it to be.
        is_fixed: True if it does not drift with the robot: it is in the cell, or the robot stands fixed.
    """

    name: str
    camera: Camera
    believed: Camera
    is_fixed: bool


class Carriage(NamedTuple):
    """The carriage that the robot drives on, with markers on its top.

    Attributes:
        base: the arm's base, in W, m; the top is as high.
        believed: where the robot takes it to be.
    """

    base: Vector3
    believed: Vector3

    def markers_in(self, camera: Camera) -> list[Vector3]:
        """Find its markers that are in a camera's picture.

        Args:
            camera: the camera, in W.

        Returns:
            Their places in W, m.
        """
        spots = [add(self.base, (x, y, 0.0)) for x, y in _SPOTS]
        return [spot for spot in spots if dist(camera.eye, spot) <= _READ_WITHIN and is_in_view(camera, spot)]


class CameraChecks:
    """Places of carried cameras, as their latest pictures of the carriage show them."""

    def __init__(self) -> None:
        self._shifts: dict[str, CameraShift] = {}
        self._looked: dict[str, int] = {}
        self._checked: dict[str, int] = {}

    def is_due(self, one: SeeingCamera, tick: int, *, at_once: bool) -> bool:
        """Say if a camera was not looked after of late.

        Args:
            one: the camera.
            tick: number of the control tick.
            at_once: True if it was to be looked after at this tick.

        Returns:
            True if it is to be checked.
        """
        return tick - self._looked.get(one.name, -_PERIOD) >= (1 if at_once else _PERIOD)

    def is_checked(self, one: SeeingCamera, tick: int) -> bool:
        """Say if a camera showed enough of the carriage of late.

        Args:
            one: the camera.
            tick: number of the control tick.

        Returns:
            True if it did, so that its place is known.
        """
        return tick - self._checked.get(one.name, -_PERIOD) < _PERIOD

    def note(
        self,
        one: SeeingCamera,
        shown: Sequence[Vector3],
        errors: NDArray[np.float64],
        carriage: Carriage,
        tick: int,
    ) -> None:
        """Place a camera by what it shows of the carriage.

        Args:
            one: the camera.
            shown: places in W of the carriage's markers that it shows, m.
            errors: with which the detector has each (n, 3), m.
            carriage: the carriage.
            tick: number of the control tick.
        """
        self._looked[one.name] = tick
        if len(shown) < 3:
            return
        seen = (np.array(shown) - np.array(one.camera.eye)) @ _axes(one.camera) + errors
        drift = np.array(subtract(carriage.believed, carriage.base))
        known = (np.array(shown) + drift - np.array(one.believed.eye)) @ _axes(one.believed)
        found = fit_shift(seen, known)
        if found is None:
            return
        self._checked[one.name] = tick
        before = self._shifts.get(one.name)
        if found.distance() <= _NEGLIGIBLE:
            self._shifts.pop(one.name, None)
        elif before is None or found.difference(before) > _SAME:
            self._shifts[one.name] = found

    def correct(self, one: SeeingCamera, seen: Vector3) -> Vector3:
        """Move what a camera shows to where its true place has it.

        Args:
            one: the camera.
            seen: point in W as the camera has it where the robot takes it to be, m.

        Returns:
            The point in W, m.
        """
        shift = self._shifts.get(one.name)
        if shift is None:
            return seen
        axes, eye = _axes(one.believed), np.array(one.believed.eye)
        x, y, z = (eye + axes @ (shift.shift + shift.rotation @ ((np.array(seen) - eye) @ axes))).tolist()
        return (x, y, z)


def fit_shift(seen: NDArray[np.float64], known: NDArray[np.float64]) -> CameraShift | None:
    """Fit a camera's true place to points, after Kabsch.

    Args:
        seen: points in the camera's axes (n, 3), m.
        known: where they are, in the axes of the place at which the camera is believed to be (n, 3), m.

    Returns:
        The shift; None if the points are nearly in line.
    """
    first, second = seen - seen.mean(axis=0), known - known.mean(axis=0)
    if np.linalg.svd(second, compute_uv=False)[1] < _LEAST_SPREAD:
        return None
    u, _, v = np.linalg.svd(first.T @ second)
    mirrored = np.diag((1.0, 1.0, float(np.sign(np.linalg.det(u @ v)))))
    rotation = v.T @ mirrored @ u.T
    return CameraShift(rotation, known.mean(axis=0) - rotation @ seen.mean(axis=0))


def is_in_view(camera: Camera, point: Vector3) -> bool:
    """Say if a marker is in a camera's picture, near enough to be read.

    Args:
        camera: the camera, in W.
        point: middle of the marker in W, m.

    Returns:
        True if it is.
    """
    right, above, ahead = camera_axes(camera)
    away = subtract(point, camera.eye)
    depth, x, y = (sum(a * b for a, b in zip(axis, away, strict=True)) for axis in (ahead, right, above))
    if not _NEAREST <= depth <= _FARTHEST:
        return False
    half = 0.95 * depth * tan(radians(camera.field_of_view) / 2.0)
    return abs(y) <= half and abs(x) <= half * camera.width / camera.height


def _axes(camera: Camera) -> NDArray[np.float64]:
    """Return the directions right, up and ahead in a camera's picture, as columns."""
    return np.array(camera_axes(camera)).T

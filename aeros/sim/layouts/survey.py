"""Survey of a cell: places of fixtures as a camera sees their markers, or as they were surveyed at setup.

A place has a marker: on the fixed body that is declared from it, or else at the place itself. While a camera
has it in view, the place is what a detector of fiducials makes of it: with the camera's own calibration error
and a noise, both of which grow with the distance. Otherwise it is what the survey at setup says. None of them
is the truth. Heights are those of the setup, where a height gauge took them: fixtures stand on a level floor.
Not modelled: what hides a marker, on the kinematic plant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import dist, radians, tan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Camera, Pose, Vector3, add, camera_axes, seen_with, subtract
from aeros.sim.randomness import RandomSource
from aeros.spec.model.scene import Scene
from aeros.spec.model.sensor_errors import SurveyErrors

_HEIGHT_SHARE: Final = 0.2
"""Error of a height at setup as a share of that of x and y: 0.3 mm for 1.5 mm; chosen."""

_MOVED: Final = 0.01
"""Distance of a marker from where the setup has it from which a fixed camera is not believed, m: fixtures do
not move, so the camera has. It is many times the errors of both."""

_NEAREST, _FARTHEST = 0.15, 2.5
"""Distances from which a detector sees a marker of 50 mm in 320 x 240 pixels, m."""


NO_SURVEY_ERRORS: Final = SurveyErrors()


class SeeingCamera(NamedTuple):
    """A camera that looks for markers.

    Attributes:
        name: its name.
        camera: where it is, in W.
        believed: where the robot takes it to be.
        is_fixed: True if it is put up in the cell, and so does not drift with the robot.
    """

    name: str
    camera: Camera
    believed: Camera
    is_fixed: bool


class Marker(NamedTuple):
    """A marker of a place.

    Attributes:
        place: the place, in W, m.
        position: of the marker, in W, m.
        fixture: name of the body that carries it; None if it is at the place.
    """

    place: Vector3
    position: Vector3
    fixture: str | None


IsHidden = Callable[[Vector3, Marker], bool]
"""Says if something is between an eye, in W, m, and a marker."""


def markers_of(scene: Scene, poses: Mapping[str, Pose]) -> dict[str, Marker]:
    """Find the marker of every place.

    Args:
        scene: the scene.
        poses: start poses by name, which are those of places and fixed bodies for good.

    Returns:
        The markers by name of the place.
    """
    carried = {
        body.placement.frame: name
        for name, body in reversed(list(scene.bodies.items()))
        if not body.is_movable
    }
    return {
        name: Marker(poses[name].position, poses[carried.get(name, name)].position, carried.get(name))
        for name in scene.places
    }


class Survey:
    """Measured places of one plant.

    Args:
        markers: by name of the place.
        errors: of the survey.
        chance: of the errors.
    """

    def __init__(self, markers: Mapping[str, Marker], errors: SurveyErrors, chance: RandomSource) -> None:
        self._markers = markers
        self._errors = errors
        self._chance = chance
        # Draws of standard deviation 1 of errors that last, by channel.
        self._lasting: dict[str, NDArray[np.float64]] = {}

    def measure(
        self,
        tick: int,
        cameras: Iterable[SeeingCamera],
        is_hidden: IsHidden,
    ) -> dict[str, Vector3]:
        """Measure every place.

        Args:
            tick: number of the control tick.
            cameras: those that may see markers.
            is_hidden: says if something hides a marker.

        Returns:
            Positions in W by name, m.
        """
        seeing = tuple(cameras)
        return {
            name: self._place(name, marker, tick, seeing, is_hidden) for name, marker in self._markers.items()
        }

    def offset_near(self, place: Vector3, measured: Mapping[str, Vector3]) -> Vector3:
        """Return the error of the surveyed place that is nearest to a fixture, for what the fixture measures.

        Args:
            place: true position of the fixture in W, m.
            measured: from `measure`.

        Returns:
            Measured minus true position, m; zero if no place is surveyed.
        """
        if not measured:
            return (0.0, 0.0, 0.0)
        nearest = min(self._markers, key=lambda name: dist(self._markers[name].place, place))
        return subtract(measured[nearest], self._markers[nearest].place)

    def _place(
        self,
        name: str,
        marker: Marker,
        tick: int,
        cameras: Iterable[SeeingCamera],
        is_hidden: IsHidden,
    ) -> Vector3:
        errors, place = self._errors, marker.place
        if not any(errors):
            return place
        views = [
            (dist(one.camera.eye, marker.position), one)
            for one in cameras
            if is_in_view(one.camera, marker.position) and not is_hidden(one.camera.eye, marker)
        ]
        x, y, z = self._draw_once(f"survey {name}", errors.setup)
        height = place[2] + _HEIGHT_SHARE * z
        if not views:
            return (place[0] + x, place[1] + y, height)
        distance, nearest = min(views, key=lambda view: view[0])
        calibration = self._draw_once(f"calibration {nearest.name}", errors.calibration * distance)
        noise = self._draw(f"marker {name}", tick, errors.noise * distance * distance)
        displaced = subtract(seen_with(nearest.camera, nearest.believed, marker.position), marker.position)
        if nearest.is_fixed and dist(displaced, (0.0, 0.0, 0.0)) > _MOVED:
            return (place[0] + x, place[1] + y, height)
        x, y, _ = add(add(place, displaced), add(calibration, noise))
        return (x, y, height)

    def _draw(self, channel: str, tick: int, size: float) -> Vector3:
        x, y, z = (size * self._chance.generator(channel, tick).standard_normal(3)).tolist()
        return (x, y, z)

    def _draw_once(self, channel: str, size: float) -> Vector3:
        """Return an error that is the same at every tick, of a given standard deviation, m."""
        unit = self._lasting.get(channel)
        if unit is None:
            unit = self._lasting[channel] = self._chance.generator(channel).standard_normal(3)
        x, y, z = (size * unit).tolist()
        return (x, y, z)


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

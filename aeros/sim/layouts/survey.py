"""Survey of a cell: places of fixtures as a camera sees their markers, or as they were surveyed at setup.

A place has a marker: on the fixed body that is declared from it, or else at the place itself. While a camera
has it in view, the place is what a detector of fiducials makes of it: with the camera's own calibration error
and a noise, both of which grow with the distance. Otherwise it is what the survey at setup says. None of them
is the truth. Heights are those of the setup, where a height gauge took them: fixtures stand on a level floor.
A camera that was knocked would show a marker elsewhere. One in the cell is not believed, as fixtures do not
move; one that the robot carries is placed anew by the markers on the carriage (`camera_checks.py`), or is
not believed while it shows none of them.
Not modelled: what hides a marker, on the kinematic plant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import dist
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Pose, Vector3, add, seen_with, subtract
from aeros.sim.layouts.camera_checks import CameraChecks, Carriage, SeeingCamera, is_in_view
from aeros.sim.randomness import RandomSource
from aeros.spec.model.scene import Scene
from aeros.spec.model.sensor_errors import SurveyErrors

_HEIGHT_SHARE: Final = 0.2
"""Error of a height at setup as a share of that of x and y: 0.3 mm for 1.5 mm; chosen."""

_MOVED: Final = 0.01
"""Distance of a marker from where the setup has it from which a fixed camera is not believed, m: fixtures do
not move, so the camera has. It is many times the errors of both. A carried one that shows no marker of the
carriage is not believed if it has the marker as far from where it was seen last."""

NO_SURVEY_ERRORS: Final = SurveyErrors()


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


class _Shot(NamedTuple):
    tick: int
    cameras: tuple[SeeingCamera, ...]
    is_hidden: IsHidden
    carriage: Carriage | None


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
        self._seen: dict[str, Vector3] = {}
        self._checks = CameraChecks()

    def measure(
        self,
        tick: int,
        cameras: Iterable[SeeingCamera],
        is_hidden: IsHidden,
        carriage: Carriage | None = None,
    ) -> dict[str, Vector3]:
        """Measure every place.

        Args:
            tick: number of the control tick.
            cameras: those that may see markers.
            is_hidden: says if something hides a marker.
            carriage: what the robot drives on; None if cameras are not checked by it.

        Returns:
            Positions in W by name, m.
        """
        if not any(self._errors):
            return {name: marker.place for name, marker in self._markers.items()}
        shot = _Shot(tick, tuple(cameras), is_hidden, carriage)
        return {name: self._place(name, marker, shot) for name, marker in self._markers.items()}

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

    def _place(self, name: str, marker: Marker, shot: _Shot) -> Vector3:
        place = marker.place
        x, y, z = self._draw_once(f"survey {name}", self._errors.setup)
        at_setup = (place[0] + x, place[1] + y, place[2] + _HEIGHT_SHARE * z)
        views = [
            (dist(one.camera.eye, marker.position), one)
            for one in shot.cameras
            if is_in_view(one.camera, marker.position) and not shot.is_hidden(one.camera.eye, marker)
        ]
        for _, camera in sorted(views, key=lambda view: view[0]):
            before = self._seen.get(name, at_setup)
            found = self._place_with(camera, name, marker, before, shot)
            if found is not None:
                self._seen[name] = seen = (found[0], found[1], at_setup[2])
                return seen
        return at_setup

    def _place_with(
        self, one: SeeingCamera, name: str, marker: Marker, before: Vector3, shot: _Shot
    ) -> Vector3 | None:
        """Return a place as a camera shows it, or None if the camera is not believed."""
        errors, distance = self._errors, dist(one.camera.eye, marker.position)
        calibration = self._draw_once(f"calibration {one.name}", errors.calibration * distance)
        noise = self._draw(f"marker {name}", shot.tick, errors.noise * distance * distance)
        seen = seen_with(one.camera, one.believed, marker.position)
        if one.is_fixed and dist(seen, marker.position) > _MOVED:
            return None
        seen = add(seen, add(calibration, noise))
        offset = subtract(marker.place, marker.position)
        if one.is_fixed or shot.carriage is None:
            return add(seen, offset)
        found = add(self._checks.correct(one, seen), offset)
        jumped = _level_distance(found, before) > _MOVED
        if self._checks.is_due(one, shot.tick, at_once=jumped):
            self._check(one, shot, shot.carriage)
            found = add(self._checks.correct(one, seen), offset)
        is_trusted = self._checks.is_checked(one, shot.tick) or _level_distance(found, before) <= _MOVED
        return found if is_trusted else None

    def _check(self, one: SeeingCamera, shot: _Shot, carriage: Carriage) -> None:
        """Place a camera by the markers on the carriage that it shows."""
        errors = self._errors
        shown = [
            spot
            for spot in carriage.markers_in(one.camera)
            if not shot.is_hidden(one.camera.eye, Marker(spot, spot, None))
        ]
        distances = np.array([[dist(one.camera.eye, spot)] for spot in shown]).reshape(-1, 1)
        unit = self._chance.generator(f"carriage {one.name}", shot.tick).standard_normal((len(shown), 3))
        lasting = np.array(self._draw_once(f"calibration {one.name}", errors.calibration))
        self._checks.note(
            one, shown, lasting * distances + errors.noise * distances**2 * unit, carriage, shot.tick
        )

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


def _level_distance(first: Vector3, second: Vector3) -> float:
    return dist(first[:2], second[:2])

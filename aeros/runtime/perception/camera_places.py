"""Places of cameras: where a picture of the robot's own carriage shows a camera to be.

A camera that was knocked, or put up elsewhere, says that it is where it was declared, and all that it shows
is elsewhere. The carriage's top is a level rectangle whose place the robot knows, so each picture that shows
enough of it tells where the camera is. Perceivers and the map of obstacles get pictures from there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from aeros.runtime.perception.posture_log import PostureLog
from aeros.runtime.ports import CameraPicture
from aeros.runtime.records.failed_measurements import RecordEvent
from aeros.spec.model.motion import MotionPolicy

if TYPE_CHECKING:
    from aeros.perception.obstacles import SpaceBox
    from aeros.perception.own_base import CameraShift

_NEGLIGIBLE: Final = 0.012
"""Greatest distance, m, by which a camera shows a thing 1 m away elsewhere, and stays where it is declared:
a picture shows that with an error of some 5 mm, and perceivers live with as much."""

_PIXELS: Final = 1.5
"""The same in pixels, for a camera that is farther away."""

_SAME: Final = 0.008
"""Greatest difference of two shifts of a camera, m at a distance of 1 m, that is of the pictures' noise."""


class CameraPlaces:
    """Places of the cameras, as the latest pictures of the carriage show them.

    Args:
        postures: of the robot, as it was when a picture was taken.
        record: writes the event `camera-moved` into the audit record.
    """

    def __init__(self, postures: PostureLog, record: RecordEvent) -> None:
        self._postures, self._record = postures, record
        self._shifts: dict[str, CameraShift] = {}
        self._placed: dict[str, CameraPicture] = {}
        self._times: dict[str, float] = {}

    def place(self, pictures: Mapping[str, CameraPicture], policy: MotionPolicy) -> dict[str, CameraPicture]:
        """Put cameras where their pictures show them to be.

        Args:
            pictures: newest picture of each camera, by its name.
            policy: its obstacles name the box of the carriage; without one, cameras are where they say.

        Returns:
            The pictures by camera.
        """
        obstacles = policy.obstacles
        if obstacles is None or obstacles.base is None:
            return dict(pictures)
        for name, picture in pictures.items():
            if self._times.get(name) != picture.time:
                self._times[name] = picture.time
                self._placed[name] = self._place_one(picture, policy)
        return {name: self._placed[name] for name in pictures}

    def _place_one(self, picture: CameraPicture, policy: MotionPolicy) -> CameraPicture:
        # NumPy, which the runtime does without where nothing is perceived.
        from aeros.perception.obstacles import depth_picture
        from aeros.perception.own_base import find_camera_shift, true_place

        box = self._carriage(picture.time, policy)
        if picture.depth is None or box is None:
            return picture
        seen = depth_picture(picture.depth, (picture.width, picture.height), picture.view)
        found, known = find_camera_shift(seen, box), self._shifts.get(picture.camera)
        coarse = 0.0 if found is None else _PIXELS * found.pixel
        if found is not None and found.distance() <= max(_NEGLIGIBLE, coarse):
            if self._shifts.pop(picture.camera, None) is not None:
                self._note(picture, None)
        elif found is not None and (known is None or found.difference(known) > max(_SAME, coarse)):
            self._shifts[picture.camera] = found
            self._note(picture, found)
        shift = self._shifts.get(picture.camera)
        if shift is None:
            return picture
        eye, target, up = true_place(seen, shift)
        return replace(picture, view=picture.view._replace(eye=eye, target=target, up=up))

    def _note(self, picture: CameraPicture, shift: CameraShift | None) -> None:
        """Record that a camera is elsewhere than before: m and rad, from where it is declared."""
        right, up, ahead = (0.0, 0.0, 0.0) if shift is None else shift.shift.tolist()
        turn = 0.0 if shift is None else shift.angle
        place = {"right": right, "up": up, "ahead": ahead, "turn": turn}
        self._record("camera-moved", {"camera": picture.camera, "at": picture.time, **place})

    def _carriage(self, time: float, policy: MotionPolicy) -> SpaceBox | None:
        """Return the box of the carriage in W, m, when a picture was taken."""
        from aeros.perception.obstacles import SpaceBox

        posture = self._postures.at(time)
        if posture is None or policy.obstacles is None or policy.obstacles.base is None:
            return None
        (x, y, z), box = posture.base, policy.obstacles.base
        (a, b, c), (d, e, f) = (tuple(map(float, corner)) for corner in (box.lower, box.upper))
        return SpaceBox((a + x, b + y, c + z), (d + x, e + y, f + z))

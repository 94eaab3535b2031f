"""Check of the pictures of a plant that has cameras."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from math import dist, isfinite

from aeros.runtime.ports import CameraPicture, newest_pictures
from aeros.sim.conformance.plant_under_test import (
    PlantUnderTest,
    RecordingMonitor,
    begin_motion,
    require,
    wait_for_end,
)


def a_look_brings_a_new_picture_of_its_own_time(subject: PlantUnderTest) -> None:
    """Check that a look brings a whole picture of its camera, taken while it lasted, and changes no other.

    A plant whose author states no look passes.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    look = subject.look_action
    if look is None:
        return
    with subject.plant() as plant:
        before, start = newest_pictures(plant), plant.now()
        wait_for_end(plant, begin_motion(plant, look), RecordingMonitor())
        pictures, end = newest_pictures(plant), plant.now()
        require(newest_pictures(plant) == pictures, "pictures change although no time has passed")
    _require_whole(pictures, end)
    changed = {name for name, one in pictures.items() if before.get(name) != one}
    require(len(changed) == 1, f"one look changes the pictures of {len(changed)} cameras")
    time = pictures[changed.pop()].time
    require(start <= time <= end, f"the picture is of {time} s, but the look was from {start} s to {end} s")


def _require_whole(pictures: Mapping[str, CameraPicture], now: float) -> None:
    for name, picture in pictures.items():
        require(picture.camera == name, f"the picture of `{name}` is of the camera `{picture.camera}`")
        require(
            isfinite(picture.time) and picture.time <= now,
            f"the picture of `{name}` is of {picture.time} s, but it is {now} s",
        )
        view = picture.view
        numbers = (*view.eye, *view.target, *view.up, view.field_of_view)
        require(
            all(map(isfinite, numbers))
            and dist(view.eye, view.target) > 0.0
            and 0.0 < view.field_of_view < 180.0,
            f"the place of `{name}` is {view}, which is none",
        )
        if picture.depth is not None:
            depth = array("f", picture.depth)
            require(min(depth) > 0.0, f"a pixel of `{name}` is {min(depth)} m deep, behind the camera")

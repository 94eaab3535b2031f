"""The check of pictures accepts a plant with a camera, and refuses one that breaks its promise."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import replace
from math import nan
from typing import Any

import pytest

from aeros.runtime.ports import CameraPicture, CameraView
from aeros.sim.conformance.picture_checks import a_look_brings_a_new_picture_of_its_own_time as check
from aeros.sim.conformance.suite import CHECKS, ConformanceError, PlantUnderTest
from aeros.sim.fake import FakePlant
from aeros.skill import act
from tests.unit.sim.conformance.subjects import KINEMATIC, REACH

VIEW = CameraView((0.5, 0.0, 1.0), (0.5, 0.0, 0.0), (1.0, 0.0, 0.0), 45.0)


def picture(camera: str, time: float, red: int = 9, depth: float = 1.0) -> CameraPicture:
    return CameraPicture(camera, time, 2, 1, bytes((red, 0, 0) * 2), array("f", [depth] * 2).tobytes(), VIEW)


class Looking(FakePlant):
    """A plant with two cameras; a look with `overhead` takes half a second."""

    def __init__(self, **taken: Any) -> None:
        super().__init__()
        self._taken = taken

    def pictures(self) -> Mapping[str, CameraPicture]:
        old = {name: picture(name, 0.0) for name in ("overhead", "mast")}
        return {**old, **self._taken} if self.now() > 0.0 else old


def subject(**taken: Any) -> PlantUnderTest:
    return replace(
        KINEMATIC,
        make_plant=lambda: Looking(**taken),
        motion_action=REACH,
        look_action=act("look", camera="overhead"),
    )


def test_a_plant_with_a_camera_passes() -> None:
    assert check in CHECKS
    check(subject(overhead=picture("overhead", 0.0, red=10)))


def test_a_plant_whose_author_states_no_look_passes() -> None:
    check(replace(subject(), look_action=None))


@pytest.mark.parametrize(
    ("taken", "why"),
    [
        ({}, "one look changes the pictures of 0 cameras"),
        (
            {name: picture(name, 0.0, red=10) for name in ("overhead", "mast")},
            "one look changes the pictures of 2 cameras",
        ),
        ({"overhead": picture("overhead", -1.0)}, r"the picture is of -1\.0 s, but the look was from 0\.0 s"),
        ({"overhead": picture("overhead", 99.0)}, r"the picture of `overhead` is of 99\.0 s, but it is"),
        ({"overhead": picture("overhead", nan)}, r"the picture of `overhead` is of nan s"),
        ({"overhead": picture("mast", 0.0)}, "the picture of `overhead` is of the camera `mast`"),
        ({"overhead": picture("overhead", 0.0, depth=-1.0)}, r"a pixel of `overhead` is -1\.0 m deep"),
        (
            {"overhead": replace(picture("overhead", 0.0), view=VIEW._replace(target=VIEW.eye))},
            "the place of `overhead` is .*, which is none",
        ),
    ],
)
def test_a_plant_that_breaks_the_promise_is_refused(taken: dict[str, CameraPicture], why: str) -> None:
    with pytest.raises(ConformanceError, match=why):
        check(subject(**taken))


def test_pictures_that_change_by_being_asked_for_are_refused() -> None:
    class Restless(Looking):
        count = 0

        def pictures(self) -> Mapping[str, CameraPicture]:
            self.count += 1
            return {"overhead": picture("overhead", 0.0, red=self.count)}

    with pytest.raises(ConformanceError, match="pictures change although no time has passed"):
        check(replace(subject(), make_plant=Restless))

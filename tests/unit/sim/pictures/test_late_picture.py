"""A picture that is computed late shows the moment at which it was taken."""

from __future__ import annotations

import numpy as np

from aeros.sim.geometry import UPRIGHT, Camera, Pose
from aeros.sim.pictures.late_picture import LatePicture
from aeros.sim.pictures.ray_caster import place
from aeros.sim.pictures.solids import box

CAMERA = Camera((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), up=(1.0, 0.0, 0.0), width=8, height=6)


def test_a_picture_is_computed_once_and_says_where_it_was_taken_from() -> None:
    floor = place(box((9.0, 9.0, 0.2), (0.5, 0.5, 0.5)), Pose((0.0, 0.0, -0.1), UPRIGHT))
    late = LatePicture("overhead", 1.5, CAMERA, [floor])
    picture = late.picture()
    assert picture is late.picture()
    assert (picture.camera, picture.time, picture.width, picture.height) == ("overhead", 1.5, 8, 6)
    assert picture.view == (CAMERA.eye, CAMERA.target, CAMERA.up, CAMERA.field_of_view)
    assert np.frombuffer(picture.depth or b"", np.float32).tolist() == [2.0] * 48

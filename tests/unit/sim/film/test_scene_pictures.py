"""Pictures show bodies where they are, and marks in their colours."""

from __future__ import annotations

import numpy as np

from aeros.sim.film.film_model import FilmModel
from aeros.sim.film.scene_pictures import Dot, FloorRing, Line, ScenePictures, Zone
from aeros.sim.geometry import Camera
from tests.unit.sim.film.recordings import recording, samples

ABOVE = Camera((1.5, 0.0, 1.5), (1.5, 0.0, 0.0), (1.0, 0.0, 0.0), 60.0, 320, 180)


def test_bodies_and_marks_are_drawn(opengl: str) -> None:
    film = FilmModel(recording(3), (320, 180))
    pictures = ScenePictures(film, (320, 180))
    film.place(samples(1)[0], [])
    empty = pictures.draw(ABOVE)
    assert empty.shape == (180, 320, 3)
    red = (0.9, 0.0, 0.0, 1.0)
    for mark in (
        Dot((1.5, 0.0, 0.1), 0.1, red),
        Line([(1.5, 0.0, 0.1), (1.6, 0.0, 0.1), (1.6, 0.0, 0.1)], 0.2, red),
        FloorRing((1.5, 0.0, 0.1), 0.3, red, 0.9),
        Zone((1.4, -0.1, 0.0), (1.6, 0.1, 0.2), red),
    ):
        drawn = pictures.draw(ABOVE, [mark])
        assert drawn[90, 160, 0] > drawn[90, 160, 1] + 60
        assert np.abs(drawn[5].astype(int) - empty[5].astype(int)).max() < 10
    assert np.array_equal(pictures.draw(ABOVE), empty)
    # More marks than there is room for are left out.
    assert pictures.draw(ABOVE, [FloorRing((1.5, 0.0, 0.1), 0.3, red, 0.9)] * 50).shape == empty.shape

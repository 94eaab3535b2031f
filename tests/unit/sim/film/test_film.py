"""A film has the pictures of the part that was asked for, at its speed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aeros.sim.film.captions import Caption, PersonSeparation
from aeros.sim.film.film import EmptyFilmError, FilmFrames, FilmOptions, make_film
from aeros.sim.film.film_span import read_film_span
from tests.unit.sim.film.recordings import recording
from tests.unit.sim.films import frames_of

SMALL = FilmOptions(size=(320, 180), title="walk")


@pytest.mark.parametrize(
    ("options", "rate", "count"),
    [
        (SMALL, 30, 31),
        (replace(SMALL, speed=4.0), 30, 8),
        (replace(SMALL, start=0.5, end=0.7), 30, 7),
        (replace(SMALL, start=0.5, end=99.0), 15, 8),
    ],
)
def test_a_film_has_a_picture_for_each_step_of_the_run(options: FilmOptions, rate: int, count: int) -> None:
    assert len(FilmFrames(recording(), lambda _: Caption(), options, rate)) == count


def test_a_part_after_the_end_is_refused() -> None:
    with pytest.raises(EmptyFilmError, match=r"nothing was recorded after 5 s: the recording ends at 1\.0 s"):
        FilmFrames(recording(), lambda _: Caption(), replace(SMALL, start=5.0), 30)


def test_a_film_says_which_part_of_the_run_it_shows(opengl: str, tmp_path: Path) -> None:
    pytest.importorskip("av")
    options = replace(SMALL, start=0.5, speed=4.0, has_captions=False)
    film = make_film(recording(), lambda _: Caption(), tmp_path / "film.mp4", options)
    # Four pictures, each for 4/30 s of the run.
    assert read_film_span(film) == pytest.approx((0.5, 0.5 + 16 / 30, 4.0))


def test_a_film_is_drawn_with_captions_rings_and_a_camera(opengl: str, tmp_path: Path) -> None:
    caption = Caption("waiting", "person at 0.61 m", camera="top", separation=PersonSeparation(0.6, 0.9, 2.3))
    done: list[tuple[int, int]] = []
    options = replace(SMALL, end=0.1)
    films = []
    for name, each in (("with", options), ("without", replace(options, has_captions=False))):
        film = tmp_path / f"{name}.webp"
        film.write_bytes(make_film(recording(), lambda _: caption, film, each, lambda *one: done.append(one)))
        films.append(frames_of(film)[0].astype(int))
    assert done == [(1, 2), (2, 2)] * 2
    assert films[0].shape == films[1].shape == (180, 320, 3)
    assert np.abs(films[0] - films[1]).mean() > 5

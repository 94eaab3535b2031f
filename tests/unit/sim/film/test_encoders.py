"""Films in each format, read back by a library that did not have to write them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from aeros.cli.arguments import FILM_SUFFIXES
from aeros.sim.film.encoders import FilmPackageError, open_encoder
from tests.unit.sim.films import frames_of

COLOURS = ((200, 30, 30), (30, 30, 200), (30, 160, 30))


def plain(colour: tuple[int, int, int]) -> NDArray[np.uint8]:
    return np.full((48, 64, 3), colour, dtype=np.uint8)


@pytest.mark.parametrize("suffix", FILM_SUFFIXES)
def test_a_film_has_each_picture_in_order(suffix: str, tmp_path: Path) -> None:
    film = tmp_path / f"film{suffix}"
    encoder = open_encoder(film, (64, 48), 10)
    for colour in COLOURS:
        encoder.add(plain(colour))
    film.write_bytes(encoder.finish())
    frames = frames_of(film)
    assert [frame.shape for frame in frames] == [(48, 64, 3)] * 3
    for frame, colour in zip(frames, COLOURS, strict=True):
        # Colours are stored at half the resolution, and a little apart.
        assert np.abs(frame.reshape(-1, 3).mean(axis=0) - colour).max() < 14


@pytest.mark.parametrize(("suffix", "unit"), [(".gif", 10), (".webp", 1)])
def test_pictures_last_as_long_as_the_rate_says(suffix: str, unit: int, tmp_path: Path) -> None:
    film = tmp_path / f"film{suffix}"
    encoder = open_encoder(film, (64, 48), 15)
    for number in range(15):
        encoder.add(plain(COLOURS[number % 3]))
    film.write_bytes(encoder.finish())
    with Image.open(film) as read:
        durations = []
        for number in range(15):
            read.seek(number)
            read.load()
            durations.append(read.info["duration"])
    assert sum(durations) == 1000
    assert all(abs(one - 1000 / 15) < unit for one in durations)


def test_without_pyav_there_is_no_mp4_and_the_cure_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "aeros.sim.film.mp4", raising=False)
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(FilmPackageError, match=r"\[film\]'` in the clone of AEROS \(av is missing\)"):
        open_encoder(tmp_path / "film.mp4", (64, 48), 30)

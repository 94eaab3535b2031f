"""Films in H.264, read back."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from aeros.sim.engine.mp4 import encode_mp4
from tests.unit.sim.films import frames_of

RED, BLUE = (200, 30, 30), (30, 30, 200)


def plain(colour: tuple[int, int, int], size: tuple[int, int] = (64, 48)) -> Image.Image:
    return Image.new("RGB", size, colour)


def test_a_film_has_each_picture_in_order(tmp_path: Path) -> None:
    film = tmp_path / "film.mp4"
    film.write_bytes(encode_mp4([plain(RED), plain(BLUE), plain(RED)], 5))
    frames = frames_of(film)
    assert [frame.shape for frame in frames] == [(48, 64, 3)] * 3
    for frame, colour in zip(frames, (RED, BLUE, RED), strict=True):
        # Colours are stored at half the resolution, and a little apart.
        assert np.abs(frame.reshape(-1, 3).mean(axis=0) - colour).max() < 12


@pytest.mark.parametrize(("count", "rate"), [(1, 30), (10, 5)])
def test_a_film_has_the_asked_rate_and_a_format_that_players_know(
    count: int, rate: int, tmp_path: Path
) -> None:
    film = tmp_path / "film.mp4"
    film.write_bytes(encode_mp4([plain(RED, (32, 16))] * count, rate))
    with av.open(film) as container:
        (stream,) = container.streams.video
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.frames) == (32, 16, count)
        assert stream.average_rate == rate


def test_a_film_needs_a_picture() -> None:
    with pytest.raises(IndexError):
        encode_mp4([], 5)

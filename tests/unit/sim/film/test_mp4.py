"""Films in H.264 have the asked rate, and a format that players know."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import av
import numpy as np

from aeros.sim.film.film_span import FilmSpan, read_film_span
from aeros.sim.film.mp4 import Mp4Encoder


def test_a_film_has_the_asked_rate_and_a_format_that_players_know(tmp_path: Path) -> None:
    film = tmp_path / "film.mp4"
    encoder = Mp4Encoder((32, 16), 30, "23")
    for _ in range(10):
        encoder.add(np.zeros((16, 32, 3), dtype=np.uint8))
    film.write_bytes(encoder.finish())
    with av.open(film) as container:
        (stream,) = container.streams.video
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.frames) == (32, 16, 10)
        assert stream.average_rate == 30


def test_a_comment_is_where_players_and_reports_look_for_it() -> None:
    span = FilmSpan(1.5, 9.0, 4.0)
    encoder = Mp4Encoder((32, 16), 30, "23", comment=span.comment())
    encoder.add(np.zeros((16, 32, 3), dtype=np.uint8))
    content = encoder.finish()
    with av.open(BytesIO(content)) as container:
        assert container.metadata["comment"] == span.comment()
    assert read_film_span(content) == span

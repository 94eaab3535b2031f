"""The video of an episode has one picture for each frame, and statistics of its pixels."""

from __future__ import annotations

from io import BytesIO

import av
import numpy as np
import pytest

from aeros.sim.film.episode_video import draw_video
from tests.unit.sim.film.recordings import recording


@pytest.mark.parametrize(
    ("frames", "end"), [(4, 0.3), (13, 1.2)], ids=["shorter", "longer than the recording"]
)
def test_each_frame_has_a_picture(opengl: str, frames: int, end: float) -> None:
    video = draw_video(recording(), 0.0, frames, (320, 180), 10)
    with av.open(BytesIO(video.content), "r") as container:
        pictures = list(container.decode(video=0))
    assert [one.time for one in pictures] == pytest.approx([number / 10 for number in range(frames)])
    assert pictures[-1].time == pytest.approx(end)
    assert {one.key_frame for one in pictures[::2]} == {True}
    assert video.statistics["count"] == [frames]
    pixels = np.stack([one.to_ndarray(format="rgb24") for one in pictures]).astype(float) / 255.0
    for name, found in (("mean", pixels.mean(axis=(0, 1, 2))), ("q50", np.median(pixels, axis=(0, 1, 2)))):
        # H.264 is lossy.
        assert np.array(video.statistics[name]) == pytest.approx(found.reshape(3, 1, 1), abs=0.02)
    assert np.array(video.statistics["std"]).shape == (3, 1, 1)

"""Video of an episode for datasets: the bodies alone, one picture for each frame, and its statistics."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice, repeat
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.film.captions import Caption
from aeros.sim.film.film import FilmFrames, FilmOptions
from aeros.sim.film.mp4 import Mp4Encoder
from aeros.sim.film.recording import Recording

_QUALITY: Final = "23"

_KEY_PICTURES: Final = 2
"""Each second picture is a key picture, as LeRobot's own are: its readers take pictures in any order."""

_QUANTILES: Final = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


class EpisodeVideo(NamedTuple):
    """A video.

    Attributes:
        content: an MP4 file.
        statistics: `min`, `max`, `mean`, `std` and quantiles of each channel in [0, 1], as lists of shape
            (3, 1, 1); and `count`, the number of pictures.
    """

    content: bytes
    statistics: Mapping[str, Any]


def draw_video(
    recording: Recording, start: float, frames: int, size: tuple[int, int], rate: int
) -> EpisodeVideo:
    """Draw an episode.

    Args:
        recording: poses of the bodies.
        start: time of the first picture, s.
        frames: number of pictures; the last one is repeated if the recording is shorter.
        size: width and height, pixels.
        rate: pictures per second.

    Returns:
        The video.

    Raises:
        EmptyFilmError: the recording ends before `start`.
        OpenGlError: nothing here can draw.
    """
    end = start + (frames - 1) / rate
    options = FilmOptions(size, camera="fixed", start=start, end=end, has_captions=False, has_shadows=False)
    encoder = Mp4Encoder(size, rate, _QUALITY, _KEY_PICTURES)
    histogram = np.zeros((3, 256), dtype=np.int64)
    picture: NDArray[np.uint8] | None = None
    count = 0
    for picture in islice(FilmFrames(recording, _no_caption, options, rate).pictures(), frames):
        _count_levels(picture, histogram)
        encoder.add(picture)
        count += 1
    if picture is not None:
        for last in repeat(picture, frames - count):
            _count_levels(last, histogram)
            encoder.add(last)
    return EpisodeVideo(encoder.finish(), {**_statistics(histogram), "count": [frames]})


def _no_caption(time: float) -> Caption:
    """Return an empty caption; none is drawn."""
    return Caption(since=time)


def _count_levels(picture: NDArray[np.uint8], histogram: NDArray[np.int64]) -> None:
    for channel in range(3):
        histogram[channel] += np.bincount(picture[..., channel].ravel(), minlength=256)


def _statistics(histogram: NDArray[np.int64]) -> dict[str, Any]:
    """Compute the statistics of each channel from the numbers of pixels of each level, 0 to 255."""
    levels = np.arange(256) / 255.0
    shares = histogram / histogram.sum(axis=1, keepdims=True)
    mean = shares @ levels
    seen = [np.flatnonzero(one) for one in histogram]
    found = {
        "min": levels[[one[0] for one in seen]],
        "max": levels[[one[-1] for one in seen]],
        "mean": mean,
        "std": np.sqrt(np.maximum(shares @ levels**2 - mean**2, 0.0)),
    }
    for name, share in _QUANTILES.items():
        found[name] = levels[[int(np.searchsorted(np.cumsum(one), share)) for one in shares]]
    return {name: [[[float(value)]] for value in one] for name, one in found.items()}

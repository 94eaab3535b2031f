"""Reads films back, each by a library that did not have to write it."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence


def frames_of(film: Path) -> list[NDArray[np.uint8]]:
    """Its pictures, each of shape (height, width, 3)."""
    if film.suffix == ".mp4":
        with av.open(film) as container:
            return [
                np.asarray(frame.to_ndarray(format="rgb24"), np.uint8) for frame in container.decode(video=0)
            ]
    with Image.open(film) as pictures:
        return [np.asarray(one.convert("RGB")) for one in ImageSequence.Iterator(pictures)]

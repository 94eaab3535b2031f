"""Encode the pictures of a film: MP4 by PyAV, GIF and WebP by Pillow."""

from __future__ import annotations

from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from aeros.distribution import install_command

FORMATS: Final = {".webp": "WEBP", ".gif": "GIF"}
"""Pillow's names of the formats of animated pictures, by file suffix."""

_WEBP_QUALITY: Final = 55
"""Quality of a picture, of 100: text stays legible."""

_CONSTANT_RATE: Final = "23"
"""Quality of H.264, from 0, the best, to 51; libx264's own default."""


class FilmPackageError(Exception):
    """A package that a film needs is missing; the message says how to install it."""


class FilmEncoder(Protocol):
    """Takes the pictures of a film one by one."""

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture.

        Args:
            picture: (height, width, 3), 0 to 255.
        """

    def finish(self) -> bytes:
        """Encode the rest.

        Returns:
            The bytes of the file.
        """


def open_encoder(path: Path, size: tuple[int, int], rate: int, comment: str = "") -> FilmEncoder:
    """Open the encoder for a file.

    Args:
        path: its suffix gives the format: `.mp4`, `.webp` or `.gif`.
        size: width and height, pixels; even for `.mp4`.
        rate: pictures per second.
        comment: comment of the file; only `.mp4` has one.

    Returns:
        The encoder.

    Raises:
        FilmPackageError: the package for the format is not installed.
    """
    if path.suffix != ".mp4":
        return _AnimationEncoder(FORMATS[path.suffix], rate)
    try:
        from aeros.sim.film.mp4 import Mp4Encoder
    except ImportError as error:
        missing = f"({error.name} is missing)"
        raise FilmPackageError(
            f"writing .mp4 needs {install_command('film')} {missing}; or write .webp or .gif"
        ) from error
    return Mp4Encoder(size, rate, _CONSTANT_RATE, comment=comment)


class _AnimationEncoder:
    """Keeps all pictures, as Pillow encodes them at once."""

    def __init__(self, form: str, rate: int) -> None:
        self._form = form
        self._rate = rate
        self._pictures: list[Image.Image] = []

    def add(self, picture: NDArray[np.uint8]) -> None:
        self._pictures.append(Image.fromarray(np.ascontiguousarray(picture)))

    def finish(self) -> bytes:
        output = BytesIO()
        first, *rest = self._pictures
        # GIF counts hundredths of a second, WebP thousandths; what is rounded off goes into later pictures.
        unit = 10 if self._form == "GIF" else 1
        ends = [round(1000 / unit * number / self._rate) * unit for number in range(len(rest) + 2)]
        durations = [end - begin for begin, end in pairwise(ends)]
        options: dict[str, Any] = {"duration": durations, "loop": 0, "append_images": rest}
        if self._form == "WEBP":
            options |= {"quality": _WEBP_QUALITY, "method": 4}
        first.save(output, self._form, save_all=True, **options)
        return output.getvalue()

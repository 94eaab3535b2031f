"""Encode pictures as an MP4 film (H.264).

The sole importer of PyAV, which the extra `film` installs.
"""

from __future__ import annotations

from io import BytesIO

import av
import numpy as np
from numpy.typing import NDArray


class Mp4Encoder:
    """H.264 in pixel format yuv420p, which every player supports.

    Args:
        size: width and height, both even, pixels.
        rate: pictures per second.
        quality: constant rate factor, from 0, the best, to 51.
        key_pictures: distance of key pictures, from which a reader can start; None for the encoder's choice.
        comment: comment of the file; empty for none.
    """

    def __init__(
        self,
        size: tuple[int, int],
        rate: int,
        quality: str,
        key_pictures: int | None = None,
        comment: str = "",
    ) -> None:
        self._output = BytesIO()
        self._container = av.open(self._output, "w", format="mp4")
        if comment:
            self._container.metadata["comment"] = comment
        self._stream = self._container.add_stream("libx264", rate=rate)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        group = {} if key_pictures is None else {"g": str(key_pictures)}
        self._stream.options = {"crf": quality, **group}

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Implement `FilmEncoder.add`."""
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        self._container.mux(self._stream.encode(frame))

    def finish(self) -> bytes:
        """Implement `FilmEncoder.finish`."""
        self._container.mux(self._stream.encode())
        self._container.close()
        return self._output.getvalue()

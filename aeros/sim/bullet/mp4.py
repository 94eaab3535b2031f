"""Pictures as an MP4 film (H.264).

The sole importer of PyAV, which is there with `pip install 'aeros[video]'`.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

import av
import numpy as np
from PIL import Image as Picture


def encode_mp4(pictures: Sequence[Picture.Image], per_second: int) -> bytes:
    """The film; every player has its pixel format, which wants an even width and height."""
    film = BytesIO()
    with av.open(film, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=per_second)
        stream.width, stream.height = pictures[0].size
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.asarray(picture), format="rgb24")))
        container.mux(stream.encode())
    return film.getvalue()

"""Encode pictures as an MP4 video (H.264).

The sole importer of PyAV, which `pip install 'aeros[video]'` installs.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

import av
import numpy as np
from PIL import Image as Picture


def encode_mp4(pictures: Sequence[Picture.Image], per_second: int) -> bytes:
    """Encode an H.264 video in pixel format yuv420p, which every player supports.

    Args:
        pictures: frames of equal size; width and height are even.
        per_second: frames per second.

    Returns:
        The bytes of the file.
    """
    output = BytesIO()
    with av.open(output, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=per_second)
        stream.width, stream.height = pictures[0].size
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.asarray(picture), format="rgb24")))
        container.mux(stream.encode())
    return output.getvalue()

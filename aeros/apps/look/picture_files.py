"""PNG files of a camera's picture: its colours, and its depth as shades of grey."""

from __future__ import annotations

from array import array
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from aeros.runtime.bus.picture_messages import GREY, RGB, encode_png
from aeros.runtime.ports import CameraPicture


class SavedDepth(NamedTuple):
    """File of a picture's depth.

    Attributes:
        path: the file.
        nearest: depth of white pixels, m.
        farthest: depth of black pixels, m; those without a depth are black, too.
    """

    path: Path
    nearest: float
    farthest: float


def save_colours(picture: CameraPicture, path: Path) -> None:
    """Write the colours of a picture.

    Args:
        picture: the picture.
        path: the file, which is replaced.

    Raises:
        OSError: it cannot be written.
    """
    path.write_bytes(encode_png(picture.width, picture.height, RGB, picture.rgb))


def save_depth(picture: CameraPicture, path: Path) -> SavedDepth | None:
    """Write the depth of a picture: the nearer, the brighter.

    Args:
        picture: the picture.
        path: the file, which is replaced.

    Returns:
        The file and its scale; None if the camera measures no depth.

    Raises:
        OSError: it cannot be written.
    """
    if picture.depth is None:
        return None
    depths = array("f", picture.depth)
    known = [one for one in depths if isfinite(one)] or [0.0]
    nearest, farthest = min(known), max(known)
    scale = 255.0 / (farthest - nearest) if farthest > nearest else 0.0
    grey = bytes(
        round((farthest - one) * scale) if scale and isfinite(one) else 255 * isfinite(one) for one in depths
    )
    path.write_bytes(encode_png(picture.width, picture.height, GREY, grey))
    return SavedDepth(path, nearest, farthest)

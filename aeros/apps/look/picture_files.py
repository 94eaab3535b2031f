"""PNG files of a camera's picture: its colours, and its depth as shades of grey."""

from __future__ import annotations

import zlib
from array import array
from math import isfinite
from pathlib import Path
from struct import pack
from typing import Final, NamedTuple

from aeros.runtime.ports import CameraPicture

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"

_GREY: Final = 0
_RGB: Final = 2
"""Colour types of the PNG specification."""


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
    path.write_bytes(_png(picture.width, picture.height, _RGB, picture.rgb))


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
    path.write_bytes(_png(picture.width, picture.height, _GREY, grey))
    return SavedDepth(path, nearest, farthest)


def _png(width: int, height: int, colour_type: int, pixels: bytes) -> bytes:
    """Encode pixels of 8 bits a channel, row by row from the upper left corner."""
    row = len(pixels) // height
    rows = b"".join(b"\0" + pixels[at : at + row] for at in range(0, len(pixels), row))  # no filter
    header = pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    return _SIGNATURE + b"".join(_chunk(kind, content) for kind, content in parts)


def _chunk(kind: bytes, content: bytes) -> bytes:
    return pack(">I", len(content)) + kind + content + pack(">I", zlib.crc32(kind + content))

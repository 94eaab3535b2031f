"""Messages with pictures of cameras: `sensor_msgs/CompressedImage`, compressed as PNG without loss."""

from __future__ import annotations

import zlib
from struct import pack
from typing import Final

from aeros.runtime.bus.messages import CompressedImage, Header, stamp
from aeros.runtime.ports import CameraPicture

GREY: Final = 0
RGB: Final = 2
"""Colour types of the PNG specification."""

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"


def picture_message(picture: CameraPicture) -> CompressedImage:
    """Make a message with the colours of a picture; its frame is the camera's name.

    Args:
        picture: the picture.

    Returns:
        The message.
    """
    png = encode_png(picture.width, picture.height, RGB, picture.rgb)
    return CompressedImage(Header(stamp(picture.time), picture.camera), "png", tuple(png))


def encode_png(width: int, height: int, colour_type: int, pixels: bytes) -> bytes:
    """Encode pixels of 8 bits a channel as a PNG file.

    Args:
        width: number of columns.
        height: number of rows.
        colour_type: `GREY` or `RGB`.
        pixels: row by row from the upper left corner.

    Returns:
        The file.
    """
    row = len(pixels) // height
    rows = b"".join(b"\0" + pixels[at : at + row] for at in range(0, len(pixels), row))  # no filter
    header = pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    return _SIGNATURE + b"".join(_chunk(kind, content) for kind, content in parts)


def _chunk(kind: bytes, content: bytes) -> bytes:
    return pack(">I", len(content)) + kind + content + pack(">I", zlib.crc32(kind + content))

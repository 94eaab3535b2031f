"""Views, built from the bytes of pictures and from plain values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from aeros.perception.points import Vector3
from aeros.perception.view import Picture, Sample, View


class PictureData(NamedTuple):
    """A picture as bytes.

    Attributes:
        camera: name of the camera.
        time: plant time of the picture, s.
        size: width and height, pixels.
        rgb: 3 bytes a pixel; read-only.
        depth: a float32 a pixel, m; read-only; None if there is none.
        eye: position of the camera in W, m.
        target: point in W that it looks at, m.
        up: direction in W that is up in the picture.
        field_of_view: vertical, degrees.
        full_size: width and height of the picture of which it is a sample, pixels.
    """

    camera: str
    time: float
    size: tuple[int, int]
    rgb: bytes | memoryview
    depth: bytes | memoryview | None
    eye: Vector3
    target: Vector3
    up: Vector3
    field_of_view: float
    full_size: tuple[int, int]


def build_view(
    time: float,
    readings: Mapping[str, Any],
    samples: Mapping[str, Iterable[tuple[float, Any]]],
    pictures: Iterable[PictureData],
) -> View:
    """Build a view.

    Args:
        time: plant time, s.
        readings: values by the module's name for the variable, SI.
        samples: time and value of each sampled reading, oldest first, by the same names.
        pictures: the pictures.

    Returns:
        The view; its arrays are read-only and share the memory of the pictures.
    """
    return View(
        time,
        {one.camera: _picture(one) for one in pictures},
        dict(readings),
        {name: tuple(Sample(at, value) for at, value in timed) for name, timed in samples.items()},
    )


def _picture(data: PictureData) -> Picture:
    width, height = data.size
    rgb = np.frombuffer(data.rgb, np.uint8).reshape(height, width, 3)
    depth = None if data.depth is None else np.frombuffer(data.depth, np.float32).reshape(height, width)
    return Picture(
        data.camera,
        data.time,
        rgb,
        depth,
        data.eye,
        data.target,
        data.up,
        data.field_of_view,
        data.full_size,
    )

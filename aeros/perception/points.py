"""Points of a picture: the place in W of what each pixel shows, from its depth.

A pixel's point: p_W = eye + depth · (forward + x·right + y·up), where x and y are the pixel's coordinates on
the image plane at distance 1. Units: m. Frame: W.
"""

from __future__ import annotations

from math import radians, tan

import numpy as np
from numpy.typing import NDArray

Vector3 = tuple[float, float, float]

Points = NDArray[np.float64]
"""Points (..., 3), or (..., 2) in a plane, m."""

Mask = NDArray[np.bool_]
"""True for the pixels or points that are meant."""


def point_cloud(
    depth: NDArray[np.floating],
    eye: Vector3,
    target: Vector3,
    up: Vector3,
    field_of_view: float,
    full_size: tuple[int, int] | None = None,
) -> NDArray[np.float64]:
    """Compute the point of every pixel.

    Args:
        depth: along the optical axis (height, width), m.
        eye: position of the camera in W, m.
        target: point in W that the camera looks at, m.
        up: direction in W that is up in the picture.
        field_of_view: vertical, degrees.
        full_size: width and height of the picture that `depth` is a sample of, pixels; None if it is the
            whole picture. See `sampled_columns`.

    Returns:
        Points (height, width, 3) in W, m.
    """
    height, width = depth.shape
    full_width, full_height = full_size or (width, height)
    at = np.array(eye)
    forward = np.array(target) - at
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.array(up))
    right /= np.linalg.norm(right)
    upward = np.cross(right, forward)
    half = tan(radians(field_of_view) / 2.0)
    aspect = full_width / full_height
    # A pixel is sampled at its lower left corner, as by the TinyRenderer: pixel middles would be half a
    # pixel off.
    x = (2.0 * sampled_columns(width, full_width) / full_width - 1.0) * half * aspect
    y = (1.0 - 2.0 * (sampled_rows(height, full_height) + 1.0) / full_height) * half
    points = np.empty((height, width, 3))
    for axis in range(3):  # whole pictures at a time: with the axes innermost it takes three times as long
        rays = forward[axis] + x * right[axis] + (y * upward[axis])[:, None]
        points[:, :, axis] = at[axis] + depth * rays
    return points


def sampled_columns(width: int, full_width: int) -> NDArray[np.intp]:
    """Find the columns of a picture that a smaller picture of it consists of.

    Pixels are chosen and never averaged, as an average over an edge is the depth of nothing.

    Args:
        width: of the smaller picture, pixels.
        full_width: of the picture, pixels.

    Returns:
        Column of the picture for each column of the smaller one (width,); evenly spaced.
    """
    columns: NDArray[np.intp] = np.arange(width) * full_width // width
    return columns


def sampled_rows(height: int, full_height: int) -> NDArray[np.intp]:
    """Find the rows of a picture that a smaller picture of it consists of.

    Args:
        height: of the smaller picture, pixels.
        full_height: of the picture, pixels.

    Returns:
        Row of the picture for each row of the smaller one (height,); the last one of each block, as a pixel
        is sampled at its lower left corner.
    """
    rows: NDArray[np.intp] = ((np.arange(height) + 1) * full_height - 1) // height
    return rows


def sample_picture(
    pixels: bytes, pixel_bytes: int, full_size: tuple[int, int], size: tuple[int, int]
) -> bytes:
    """Sample a smaller picture, at the columns and rows that `sampled_columns` and `sampled_rows` give.

    Args:
        pixels: the picture, row by row from the upper left corner.
        pixel_bytes: number of bytes of each pixel.
        full_size: width and height of the picture, pixels.
        size: width and height of the smaller picture, pixels; at most those of the picture.

    Returns:
        The smaller picture in the same form.
    """
    if size == full_size:
        return pixels
    array = np.frombuffer(pixels, np.uint8).reshape(full_size[1], full_size[0], pixel_bytes)
    rows, columns = sampled_rows(size[1], full_size[1]), sampled_columns(size[0], full_size[0])
    return array[rows[:, None], columns[None, :]].tobytes()

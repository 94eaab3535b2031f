"""Noise of pictures: median and mean of a pixel and its neighbours, and patches too small for an object."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from aeros.perception.components import connected_components
from aeros.perception.points import Mask


def smooth_colours(rgb: NDArray[Any]) -> NDArray[np.uint8]:
    """Replace each colour by the median of the pixel and its eight neighbours.

    Noise of a pixel becomes 0.4 of what it was; straight edges stay where they are, and corners lose a pixel.

    Args:
        rgb: colours (height, width, 3), 0 to 255.

    Returns:
        The smooth colours (height, width, 3), 0 to 255.
    """
    height, width, _ = rgb.shape
    padded = np.pad(rgb, ((1, 1), (1, 1), (0, 0)), mode="edge")
    neighbours = np.stack(
        [padded[row : row + height, column : column + width] for row in range(3) for column in range(3)]
    )
    neighbours.partition(4, axis=0)
    return np.asarray(neighbours[4], np.uint8)


def mean_nearby(
    values: NDArray[np.float64], counted: Mask, radius: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Compute the mean of the values around each pixel.

    The noise of n pixels becomes 1 / √n of what it was, so a plane shows what is lower than the noise of one.

    Args:
        values: of each pixel (height, width).
        counted: the pixels that count (height, width).
        radius: half the side of the square around each pixel, without the pixel itself, pixels.

    Returns:
        The means (height, width), 0 where no pixel counts; and the numbers of pixels that count in each
        square (height, width).
    """
    sums = _sums_nearby(np.where(counted, values, 0.0), radius)
    numbers = np.rint(_sums_nearby(counted.astype(np.float64), radius))
    return np.where(numbers > 0.0, sums / np.maximum(numbers, 1.0), 0.0), numbers


def _sums_nearby(values: NDArray[np.float64], radius: int) -> NDArray[np.float64]:
    """Sum up the values in the square around each pixel."""
    side = 2 * radius + 1
    height, width = values.shape
    total = np.zeros((height + side, width + side))
    total[1:, 1:] = np.pad(values, radius).cumsum(axis=0).cumsum(axis=1)
    sums: NDArray[np.float64] = (
        total[side:, side:] - total[:height, side:] - total[side:, :width] + total[:height, :width]
    )
    return sums


def without_specks(mask: Mask, least: int) -> Mask:
    """Remove the patches of a mask that are too small to be an object.

    Args:
        mask: (height, width).
        least: least number of pixels of a patch that stays.

    Returns:
        The mask without its small patches (height, width).
    """
    labels, count = connected_components(mask)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0
    return np.asarray(sizes[labels] >= least)

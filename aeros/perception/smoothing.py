"""Noise of pictures: the median of each pixel and its neighbours, and patches too small to be an object."""

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

"""Outliers: points that belong to something else, by their distance from the median."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

_NORMAL: Final = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


def inlier_mask(
    values: NDArray[np.float64], deviations: float = 3.0, floor: float = 0.0
) -> NDArray[np.bool_]:
    """Find the values that are not far from the median.

    The scale is the median absolute deviation, which half of the values may not disturb.

    Args:
        values: (n,) or (n, k), n > 0; a row is an inlier if all of its numbers are.
        deviations: greatest distance from the median, in standard deviations of a normal distribution.
        floor: distance that is never too far, in the unit of the values: of nearly equal values, the scale
            is nearly 0.

    Returns:
        Mask (n,).
    """
    columns = values.reshape(len(values), -1)
    off = np.abs(columns - np.median(columns, axis=0))
    limit = np.maximum(floor, deviations * _NORMAL * np.median(off, axis=0))
    return np.asarray((off <= limit).all(axis=1), np.bool_)

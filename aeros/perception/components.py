"""Connected components of a mask: separate objects of one colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


def connected_components(mask: Mask) -> tuple[NDArray[np.intp], int]:
    """Number the connected components of a mask; pixels that share an edge are connected.

    Args:
        mask: (height, width).

    Returns:
        Number of each pixel's component (height, width), from 1 in the order of their first pixels, 0
        outside of the mask; and the number of components.
    """
    height, width = mask.shape
    # A run is a maximal interval of a row that is in the mask; runs are joined, not pixels.
    edges = np.diff(mask.astype(np.int8), axis=1, prepend=0, append=0)
    run_rows, run_starts = np.nonzero(edges == 1)
    # Lists, as single elements of arrays take ten times as long.
    starts, ends = run_starts.tolist(), np.nonzero(edges == -1)[1].tolist()
    root = list(range(len(starts)))
    first_of_row = np.searchsorted(run_rows, np.arange(height + 1)).tolist()
    for row in range(1, height):
        above, last_above = first_of_row[row - 1], first_of_row[row]
        for run in range(last_above, first_of_row[row + 1]):
            while above < last_above and ends[above] <= starts[run]:
                above += 1
            near = above
            while near < last_above and starts[near] < ends[run]:
                _join(root, near, run)
                near += 1
    labels = np.zeros((height, width), np.intp)
    numbers: dict[int, int] = {}
    for run, row in enumerate(run_rows.tolist()):
        number = numbers.setdefault(_root_of(root, run), len(numbers) + 1)
        labels[row, starts[run] : ends[run]] = number
    return labels, len(numbers)


def largest_component(mask: Mask) -> Mask:
    """Keep the largest connected component of a mask.

    Args:
        mask: (height, width).

    Returns:
        The mask of the component with most pixels (height, width), of several the first; empty if the mask
        is.
    """
    labels, count = connected_components(mask)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    return np.asarray(labels == 1 + int(np.argmax(sizes))) if count else np.zeros_like(mask)


def _root_of(root: list[int], run: int) -> int:
    while root[run] != run:
        root[run] = root[root[run]]
        run = root[run]
    return run


def _join(root: list[int], one: int, other: int) -> None:
    """Join the components of two runs; the first run of a component is its root."""
    first, second = sorted((_root_of(root, one), _root_of(root, other)))
    root[second] = first

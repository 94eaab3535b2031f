"""Decision of one bound of a network: split the input box until all parts are proved or an input violates.

A part is proved where `propagate` keeps every bounded output inside. An input violates where the box around
its outputs, rounding included, lies outside. Both hold for the network as it is executed, whatever the order
of its sums. If the budget of parts runs out, a network verifier may decide (`marabou`).
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from operator import add
from typing import Final

from aeros.spec.backends.network.box_propagation import Bounds, propagate
from aeros.spec.backends.network.steps import Linear, Network

MAX_PARTS: Final = 4096
"""Boxes that are examined for one bound at most: 1.5 s for two layers of 32."""

_MAX_CORNERS: Final = 64

Point = dict[str, tuple[float, ...]]
"""Components of each input, in the network's units."""

Target = Mapping[str, tuple[tuple[float, float], ...]]
"""Least and greatest value of each component of each bounded output, in the network's units."""


@dataclass(frozen=True)
class BoundSearch:
    """Result of the search.

    Attributes:
        is_proved: True if every input in the box keeps the bound.
        witness: an input in the box that violates the bound; None if none was found.
        parts: number of boxes that were examined.
    """

    is_proved: bool
    witness: Point | None
    parts: int


def decide_bound(
    network: Network, given: Mapping[str, Bounds], then: Target, max_parts: int = MAX_PARTS
) -> BoundSearch:
    """Decide whether every input in a box has its outputs in another.

    Args:
        network: the network.
        given: bounds of each input, in the network's units.
        then: bounds of outputs, in the network's units.
        max_parts: number of boxes to examine at most.

    Returns:
        The result; neither proved nor refuted where the budget ran out.
    """
    for corner in _corners(given):
        if violates(network, corner, then):
            return BoundSearch(False, corner, 0)
    importance = _importance(network)
    pending = deque([dict(given)])
    examined = 0
    while pending:
        if examined >= max_parts:
            return BoundSearch(False, None, examined)
        box = pending.popleft()
        examined += 1
        if _inside(propagate(network, box), then):
            continue
        middle = _middle(box, is_double=network.is_double)
        if violates(network, middle, then):
            return BoundSearch(False, middle, examined)
        parts = _halves(box, importance)
        if parts is None:  # too small to split
            return BoundSearch(False, None, examined)
        pending.extend(parts)
    return BoundSearch(True, None, examined)


def violates(network: Network, point: Point, then: Target) -> bool:
    """Tell whether an input surely violates a bound when the network is executed.

    Args:
        network: the network.
        point: the input, of numbers that the network's format holds.
        then: bounds of outputs.

    Returns:
        True if some output lies outside its bounds whatever is rounded.
    """
    found = propagate(network, {name: (list(one), list(one)) for name, one in point.items()})
    return any(
        high < low_end or low > high_end
        for name, ends in then.items()
        for low, high, (low_end, high_end) in zip(*found[name], ends, strict=True)
    )


def nearest(value: float, *, is_double: bool) -> float:
    """Round a number to the format of a network.

    Args:
        value: the number.
        is_double: True for float64, False for float32.

    Returns:
        The nearest number of the format.
    """
    return value if is_double else float(struct.unpack("f", struct.pack("f", value))[0])


def _inside(found: Mapping[str, Bounds], then: Target) -> bool:
    return all(
        low_end <= low and high <= high_end  # false for NaN
        for name, ends in then.items()
        for low, high, (low_end, high_end) in zip(*found[name], ends, strict=True)
    )


def _importance(network: Network) -> dict[str, tuple[float, ...]]:
    """Weigh each input's component by what the first layer makes of it."""
    weights = {name: [0.0] * size for name, size in network.inputs.items()}
    for step in network.steps:
        if isinstance(step, Linear) and step.source in weights:
            columns = zip(*step.absolute_weights, strict=True)
            weights[step.source] = list(map(add, weights[step.source], map(sum, columns)))
    return {name: tuple(one or 1.0 for one in ones) for name, ones in weights.items()}


def _halves(
    box: Mapping[str, Bounds], importance: Mapping[str, tuple[float, ...]]
) -> tuple[dict[str, Bounds], dict[str, Bounds]] | None:
    """Split a box in the middle of its most important side; None if that side has no middle."""
    _, name, at = max(
        ((high - low) * importance[name][at], name, at)
        for name, (lows, highs) in box.items()
        for at, (low, high) in enumerate(zip(lows, highs, strict=True))
    )
    lows, highs = box[name]
    middle = lows[at] + (highs[at] - lows[at]) / 2
    if not lows[at] < middle < highs[at]:
        return None
    below, above = list(highs), list(lows)
    below[at] = above[at] = middle
    return {**box, name: (lows, below)}, {**box, name: (above, highs)}


def _middle(box: Mapping[str, Bounds], *, is_double: bool) -> Point:
    return {
        name: tuple(
            min(max(nearest(low + (high - low) / 2, is_double=is_double), low), high)
            for low, high in zip(lows, highs, strict=True)
        )
        for name, (lows, highs) in box.items()
    }


def _corners(box: Mapping[str, Bounds]) -> Iterator[Point]:
    """Yield corners of a box, all of them where there are few."""
    sides = [(name, at) for name, (lows, _) in box.items() for at in range(len(lows))]
    free = sides[: int(math.log2(_MAX_CORNERS))]
    for choice in product(*([(side, 0), (side, 1)] for side in free)):
        chosen = dict(choice)
        yield {
            name: tuple(pair[chosen.get((name, at), 0)] for at, pair in enumerate(zip(*ends, strict=True)))
            for name, ends in box.items()
        }

"""Boxes through a network: for inputs in a box, a box that holds every output, rounding errors included.

Each step maps the box of its source to one of its target (interval bound propagation). A box is a pair of
lists of doubles, and each result is widened by more than the network's own rounding and that of this
computation together:

    dot product of n terms:   (4 n + 16) u (sum |w_i| max |x_i| + |b|) + (n + 1) * 2^-149
    one operation:            4 u |result| + 2^-149
    tanh, sigmoid:            2^-20

u = 2^-24 is the unit roundoff of float32, and 2^-53 of float64. The first is at least four times the error
of any order of summation, with or without fused operations, gamma_n = n u / (1 - n u), for n below 10^6.
Source: Higham, Accuracy and Stability of Numerical Algorithms, 2nd edition, section 3.1.
Assumes that onnxruntime computes tanh and sigmoid with an error below 2^-20, 1e-6 (ASSUME: no source gives a
bound).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from operator import add, mul, sub
from typing import Final

from aeros.spec.backends.network.steps import Clip, Join, Linear, Network, Scale, Smooth, Step, Sum

Bounds = tuple[list[float], list[float]]
"""Least and greatest value of each component."""

_SMALLEST: Final = 2.0**-149
_SMOOTH_ERROR: Final = 2.0**-20
_ROUNDOFF: Final = {False: 2.0**-24, True: 2.0**-53}


def propagate(network: Network, box: Mapping[str, Bounds]) -> dict[str, Bounds]:
    """Bound the outputs of a network.

    Args:
        network: the network.
        box: bounds of each input, in the network's units.

    Returns:
        Bounds of each output, by name; infinite or NaN where they overflow.
    """
    vectors = bound_vectors(network, box)
    return {name: vectors[vector] for name, vector in network.outputs.items()}


def bound_vectors(network: Network, box: Mapping[str, Bounds]) -> dict[str, Bounds]:
    """Bound every vector of a network.

    Args:
        network: the network.
        box: bounds of each input, in the network's units.

    Returns:
        Bounds of each vector, by name.
    """
    unit = _ROUNDOFF[network.is_double]
    vectors: dict[str, Bounds] = dict(box)
    for step in network.steps:
        vectors[step.target] = _bound_step(step, vectors, unit)
    return vectors


def rounding_errors(network: Network, vectors: Mapping[str, Bounds]) -> dict[str, list[float]]:
    """Bound the difference between a piecewise linear network as executed and its exact value.

    Args:
        network: the network, without `Smooth` steps.
        vectors: bounds of every vector, from `bound_vectors`.

    Returns:
        Greatest difference of each component of each vector, by name.
    """
    unit = _ROUNDOFF[network.is_double]
    errors = {name: [0.0] * size for name, size in network.inputs.items()}
    for step in network.steps:
        largest = _sizes(vectors[step.target])
        own = [4.0 * unit * one + _SMALLEST for one in largest]
        match step:
            case Linear(_, source, _, bias):
                size = _sizes(vectors[source])
                share = (4 * len(size) + 16) * unit
                errors[step.target] = [
                    sum(map(mul, row, errors[source]))
                    + share * (sum(map(mul, row, size)) + abs(offset))
                    + (len(size) + 1) * _SMALLEST
                    for row, offset in zip(step.absolute_weights, bias, strict=True)
                ]
            case Sum(_, first, second, _):
                before = map(add, errors[first], errors[second])
                errors[step.target] = list(map(add, before, own))
            case Scale(_, source, factors, offsets):
                before = map(mul, map(abs, factors), errors[source])
                sums = map(add, largest, map(abs, offsets))
                errors[step.target] = [
                    a + b + 4.0 * unit * c for a, b, c in zip(before, own, sums, strict=True)
                ]
            case Join(_, sources):
                errors[step.target] = [one for source in sources for one in errors[source]]
            case _:
                errors[step.target] = errors[step.source]
    return errors


def _bound_step(step: Step, vectors: Mapping[str, Bounds], unit: float) -> Bounds:
    match step:
        case Linear():
            return _linear(step, vectors[step.source], unit)
        case Sum(_, first, second, sign):
            lows, highs = vectors[second]
            added = (lows, highs) if sign > 0 else ([-one for one in highs], [-one for one in lows])
            lower = list(map(add, vectors[first][0], added[0]))
            return _widened(lower, list(map(add, vectors[first][1], added[1])), unit)
        case Scale(_, source, factors, offsets):
            ends = [list(map(mul, factors, one)) for one in vectors[source]]
            # The product is rounded before the sum, which may be smaller.
            margin = [4.0 * unit * one + _SMALLEST for one in _sizes((ends[0], ends[1]))]
            low = map(sub, map(add, map(min, *ends), offsets), margin)
            high = map(add, map(add, map(max, *ends), offsets), margin)
            return _widened(list(low), list(high), unit)
        case Clip(_, source, lower_end, upper_end):
            lows, highs = vectors[source]
            return (
                [min(max(one, lower_end), upper_end) for one in lows],
                [min(max(one, lower_end), upper_end) for one in highs],
            )
        case Smooth(_, source, name):
            function = _SMOOTH[name]
            lows, highs = vectors[source]
            return [function(one) - _SMOOTH_ERROR for one in lows], [
                function(one) + _SMOOTH_ERROR for one in highs
            ]
        case Join(_, sources):
            return (
                [one for source in sources for one in vectors[source][0]],
                [one for source in sources for one in vectors[source][1]],
            )


def _linear(step: Linear, source: Bounds, unit: float) -> Bounds:
    largest = _sizes(source)
    middle = list(map(_middle, *source))
    # Both differences, as the middle is rounded.
    radius = list(map(max, map(sub, source[1], middle), map(sub, middle, source[0])))
    lows, highs = [], []
    share, least = (4 * len(middle) + 16) * unit, (len(middle) + 1) * _SMALLEST
    for row, absolute, bias in zip(step.weights, step.absolute_weights, step.bias, strict=True):
        centre = sum(map(mul, row, middle)) + bias
        spread = sum(map(mul, absolute, radius))
        error = share * (sum(map(mul, absolute, largest)) + abs(bias)) + least
        lows.append(centre - spread - error)
        highs.append(centre + spread + error)
    return lows, highs


def _middle(low: float, high: float) -> float:
    return low + (high - low) / 2


def _sizes(bounds: Bounds) -> list[float]:
    """Return the greatest absolute value of each component."""
    return [max(abs(low), abs(high)) for low, high in zip(*bounds, strict=True)]


def _widened(lower: Sequence[float], upper: Sequence[float], unit: float) -> Bounds:
    share = 4.0 * unit
    return (
        [one - share * abs(one) - _SMALLEST for one in lower],
        [one + share * abs(one) + _SMALLEST for one in upper],
    )


def _sigmoid(value: float) -> float:
    return 0.5 + 0.5 * math.tanh(0.5 * value)  # as 1 / (1 + exp(-value)), and never overflows


_SMOOTH: Final[Mapping[str, Callable[[float], float]]] = {"tanh": math.tanh, "sigmoid": _sigmoid}

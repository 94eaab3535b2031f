"""Attenuation: the reduced parameters that violated rules prescribe. The gate decides the result again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from math import isqrt
from typing import Any, Final, cast

from aeros.runtime.gate.value_check import Scalars
from aeros.spec.expr.doubles import nearest_double_in_range
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import evaluate
from aeros.spec.model.rules import Rule

_FACTOR_BITS: Final = 128  # of the factor of a vector, which is rounded down


def attenuate_parameters(
    rules: Iterable[Rule], kind: str, parameters: Mapping[str, Any], values: Scalars
) -> dict[str, Any]:
    """Reduce parameters as each of `rules` prescribes, one rule after the other.

    No parameter becomes larger in magnitude than requested. If a rule's term would enlarge it, the term is
    not used; the proof of the site excludes this case where that rule alone is violated. The term of a vector
    is its greatest length: a longer vector is scaled, so its direction stays.

    Args:
        rules: the violated rules, each with an attenuation for `kind`.
        kind: the action kind.
        parameters: the requested parameters by name, SI.
        values: every well-formed value of the request, by scalar variable; contains all that the rules read.

    Returns:
        All parameters by name, with the reduced values rounded towards zero.
    """
    reduced = dict(parameters)
    exact = {name: Fraction(value) if type(value) is float else value for name, value in values.items()}
    for rule in rules:
        terms = rule.attenuations[kind]
        reductions = {name: cast("Fraction", evaluate(lower(term), exact)) for name, term in terms.items()}
        for name, value in reductions.items():
            if isinstance(parameters[name], list | tuple):
                parts = _shortened(name, value, exact)
                reduced[name] = tuple(map(float, parts.values()))
                exact |= parts
                continue
            size = abs(value)
            if size < abs(exact[name]):
                exact[name] = _towards_zero(value)
                reduced[name] = float(exact[name])
    return reduced


def _shortened(name: str, length: Fraction, exact: Mapping[str, Any]) -> dict[str, Fraction]:
    """Scale a vector to a length if it is longer, and round its components, by name, towards zero."""
    axes = [f"{name}.{axis}" for axis in "xyz"]
    factor = factor_to_length([exact[axis] for axis in axes], length)
    return {axis: _towards_zero(factor * exact[axis]) for axis in axes}


def factor_to_length(vector: Sequence[Fraction], length: Fraction) -> Fraction:
    """Compute the factor that shortens a vector to a length.

    Args:
        vector: its components, SI.
        length: the greatest length, SI.

    Returns:
        A factor f from 0 to 1, rounded down, with f·|vector| <= length; 1 if the vector is no longer, or if
        `length` is negative, so that no factor does.
    """
    square = sum((part * part for part in vector), Fraction(0))
    if length < 0 or square <= length * length:
        return Fraction(1)
    ratio = length * length / square
    return Fraction(isqrt((ratio.numerator << 2 * _FACTOR_BITS) // ratio.denominator), 1 << _FACTOR_BITS)


def _towards_zero(value: Fraction) -> Fraction:
    """Round to a double that is no larger in magnitude, so that it is no larger than what was declared."""
    size = abs(value)
    return Fraction(nearest_double_in_range(value, (-size, size)))

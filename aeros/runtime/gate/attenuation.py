"""Attenuation: the reduced parameters that violated rules prescribe. The gate decides the result again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any, cast

from aeros.runtime.gate.value_check import Scalars
from aeros.spec.expr.doubles import nearest_double_in_range
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import evaluate
from aeros.spec.model.rules import Rule


def attenuate_parameters(
    rules: Iterable[Rule], kind: str, parameters: Mapping[str, Any], values: Scalars
) -> dict[str, Any]:
    """Reduce parameters as each of `rules` prescribes, one rule after the other.

    No parameter becomes larger in magnitude than requested. If a rule's term would enlarge it, the term is
    not used; the proof of the site excludes this case where that rule alone is violated.

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
            size = abs(value)
            if size < abs(exact[name]):
                # Rounded towards zero, so that the double is no larger than what was declared.
                reduced[name] = nearest_double_in_range(value, (-size, size))
                exact[name] = Fraction(reduced[name])
    return reduced

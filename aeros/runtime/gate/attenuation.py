"""The action reduced as the violated rules declare.  Only a proposal: the gate decides it again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any, cast

from aeros.runtime.gate.value_check import Scalars
from aeros.spec.expr.doubles import nearest_double_in_range
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import evaluate
from aeros.spec.model.model import Rule


def attenuate_parameters(
    rules: Iterable[Rule], kind: str, parameters: Mapping[str, Any], values: Scalars
) -> dict[str, Any]:
    """The `parameters` reduced as each of `rules` declares for `kind`, one rule after the other.

    values: every well-formed value, by scalar variable; holds all that the rules read.
    No parameter is ever larger in magnitude than it was asked for: where a rule's term would make it
    so, which the proof of the site excludes where that rule alone is violated, the term is not used.
    """
    reduced = dict(parameters)
    exact = {name: Fraction(value) if type(value) is float else value for name, value in values.items()}
    for rule in rules:
        terms = rule.attenuations[kind]
        wanted = {name: cast("Fraction", evaluate(lower(term), exact)) for name, term in terms.items()}
        for name, value in wanted.items():
            size = abs(value)
            if size < abs(exact[name]):
                # Rounded towards zero, so that the double is no larger than what was declared.
                reduced[name] = nearest_double_in_range(value, (-size, size))
                exact[name] = Fraction(reduced[name])
    return reduced

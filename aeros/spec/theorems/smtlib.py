"""Formulas as SMT-LIB text: what obligations about AEROS's own code are written in.

A formula is a `str`: solvers read it as it stands, and so do people.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

TRUE = "true"
FALSE = "false"


def smt_literal(value: bool | int | Fraction) -> str:
    """A constant; fractions are reals, whole numbers integers."""
    if isinstance(value, bool):
        return TRUE if value else FALSE
    if isinstance(value, Fraction):
        size = f"(/ {abs(value).numerator} {abs(value).denominator})"
        return f"(- {size})" if value < 0 else size
    return f"(- {-value})" if value < 0 else str(value)


def smt_not(formula: str) -> str:
    """`not formula`."""
    return {TRUE: FALSE, FALSE: TRUE}.get(formula, f"(not {formula})")


def smt_and(formulas: Iterable[str]) -> str:
    """All of them; true where there is none."""
    return _joined("and", formulas, neutral=TRUE)


def smt_or(formulas: Iterable[str]) -> str:
    """Any of them; false where there is none."""
    return _joined("or", formulas, neutral=FALSE)


def smt_implies(premise: str, conclusion: str) -> str:
    """`premise implies conclusion`."""
    return f"(=> {premise} {conclusion})"


def smt_apply(function: str, *arguments: str) -> str:
    """`function` of the arguments, or itself where it has none."""
    return f"({function} {' '.join(arguments)})" if arguments else function


def _joined(operator: str, formulas: Iterable[str], *, neutral: str) -> str:
    parts = [one for one in dict.fromkeys(formulas) if one != neutral]
    if smt_not(neutral) in parts:
        return smt_not(neutral)
    return parts[0] if len(parts) == 1 else smt_apply(operator, *parts) if parts else neutral

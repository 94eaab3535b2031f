"""Formulas as SMT-LIB text, in which obligations about AEROS's own code are written.

A formula is a `str`, which solvers and people read as it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import lru_cache

TRUE = "true"
FALSE = "false"


@lru_cache(maxsize=1 << 12, typed=True)
def smt_literal(value: bool | int | Fraction) -> str:
    """Write a constant; fractions are reals, whole numbers integers.

    Args:
        value: boolean, int or fraction.

    Returns:
        The constant.
    """
    if isinstance(value, bool):
        return TRUE if value else FALSE
    if isinstance(value, Fraction):
        size = f"(/ {abs(value).numerator} {abs(value).denominator})"
        return f"(- {size})" if value < 0 else size
    return f"(- {-value})" if value < 0 else str(value)


def smt_not(formula: str) -> str:
    """Negate a formula.

    Args:
        formula: boolean formula.

    Returns:
        `(not formula)`, simplified for constants.
    """
    return {TRUE: FALSE, FALSE: TRUE}.get(formula, f"(not {formula})")


def smt_and(formulas: Iterable[str]) -> str:
    """Join formulas by `and`.

    Args:
        formulas: boolean formulas; duplicates are dropped.

    Returns:
        The conjunction; `true` if there are none.
    """
    return _joined("and", formulas, neutral=TRUE)


def smt_or(formulas: Iterable[str]) -> str:
    """Join formulas by `or`.

    Args:
        formulas: boolean formulas; duplicates are dropped.

    Returns:
        The disjunction; `false` if there are none.
    """
    return _joined("or", formulas, neutral=FALSE)


def smt_implies(premise: str, conclusion: str) -> str:
    """Write an implication.

    Args:
        premise: boolean formula.
        conclusion: boolean formula.

    Returns:
        `(=> premise conclusion)`.
    """
    return f"(=> {premise} {conclusion})"


def smt_apply(function: str, *arguments: str) -> str:
    """Apply a function to arguments.

    Args:
        function: name of the function or operator.
        *arguments: terms.

    Returns:
        The application; the function itself if there are no arguments.
    """
    return f"({function} {' '.join(arguments)})" if arguments else function


def _joined(operator: str, formulas: Iterable[str], *, neutral: str) -> str:
    parts = [one for one in dict.fromkeys(formulas) if one != neutral]
    if smt_not(neutral) in parts:
        return smt_not(neutral)
    return parts[0] if len(parts) == 1 else smt_apply(operator, *parts) if parts else neutral

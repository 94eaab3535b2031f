"""Formulas in AEROS's expression language as text, simplified where a part is constant."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

TRUE: Final = "true"
FALSE: Final = "false"


def negation(one: str) -> str:
    """Return the formula that is true where `one` is false."""
    constant = {TRUE: FALSE, FALSE: TRUE}.get(one)
    return constant or (one.removeprefix("not ") if one.startswith("not ") else f"not {one}")


def conjunction(parts: Iterable[str]) -> str:
    """Return the formula that is true where all parts are."""
    return _join("and", parts, TRUE, FALSE)


def disjunction(parts: Iterable[str]) -> str:
    """Return the formula that is true where some part is."""
    return _join("or", parts, FALSE, TRUE)


def _join(word: str, parts: Iterable[str], neutral: str, absorbing: str) -> str:
    kept = list(dict.fromkeys(part for part in parts if part != neutral))
    if absorbing in kept:
        return absorbing
    if not kept:
        return neutral
    return kept[0] if len(kept) == 1 else f"({f' {word} '.join(kept)})"

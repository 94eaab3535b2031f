"""Differences of times in doubles, and the window that they are compared with."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType
from typing import Any, Final

from aeros.spec.expr.doubles import neighbours
from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.smtlib import literal
from aeros.spec.theorems.symbolic_execution import Symbol

WINDOW: Final = "aeros.runtime.gate.time_window"

LENGTHS: Final = {"a-double": Fraction(10), "no-double": Fraction(1, 10)}
"""A length of a window that is a double, and one that is not: both kinds of length that there are."""

TIMES: Final = (
    "(declare-const earlier Real)",
    "(declare-const later Real)",
    "(declare-fun rounded (Real) Real)",
)

APART: Final = "(- later earlier)"


class Double(Symbol):
    """A double; what is added and subtracted is rounded.  A time that never was is infinitely far away."""

    __slots__ = ()

    def __sub__(self, other: Any) -> Any:
        if isinstance(other, float):
            return -other
        return Double(f"(rounded (- {self.term} {other.term}))", self.ask)

    def __add__(self, other: Any) -> Double:
        return Double(f"(rounded (+ {self.term} {other.term}))", self.ask)


def window_module(code: Code) -> ModuleType:
    """A copy of `window.py` that takes symbols for exact fractions."""
    return code.module(WINDOW, Fraction=lambda value: Symbol(value.term, value.ask))


def bounds_of(length: Fraction) -> dict[str, Fraction]:
    """The doubles below and above that length; both it, where it is one."""
    return dict(zip(("below", "above"), map(Fraction, neighbours(length)), strict=True))


def rounding(length: Fraction) -> dict[str, str]:
    """What is assumed of `rounded`: it keeps order, and TwoSum finds what it took off."""
    share = f"(rounded (- (rounded {APART}) later))"
    corrected = f"(rounded (- later (rounded (- (rounded {APART}) {share}))))"
    error = f"(rounded (- {corrected} (rounded (+ earlier {share}))))"
    return {
        **{
            f"rounding-keeps-order.{name}": f"(and (=> (<= {APART} {literal(one)})"
            f" (<= (rounded {APART}) {literal(one)}))"
            f" (=> (>= {APART} {literal(one)}) (>= (rounded {APART}) {literal(one)})))"
            for name, one in bounds_of(length).items()
        },
        "twosum": f"(= {error} (- {APART} (rounded {APART})))",
    }

"""Differences of times in doubles, and the window that they are compared with."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType
from typing import Any, Final

from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import SymbolicValue

WINDOW: Final = "aeros.runtime.gate.quotas"

LENGTHS: Final = {"a-double": Fraction(10), "no-double": Fraction(1, 10)}
"""A length of a window that is a double, and one that is not: both kinds of length that there are."""

TIMES: Final = (
    "(declare-const earlier Real)",
    "(declare-const later Real)",
    "(declare-fun rounded (Real) Real)",
)

TIME_DIFFERENCE: Final = "(- later earlier)"


class SymbolicDouble(SymbolicValue):
    """A double; what is added and subtracted is rounded.  A time that never was is infinitely far away."""

    __slots__ = ()

    def __sub__(self, other: Any) -> Any:
        if isinstance(other, float):
            return -other
        return SymbolicDouble(f"(rounded (- {self.term} {other.term}))", self.ask)

    def __add__(self, other: Any) -> SymbolicDouble:
        return SymbolicDouble(f"(rounded (+ {self.term} {other.term}))", self.ask)


def window_module(code: ModuleSource) -> ModuleType:
    """A copy of `quotas.py` that takes symbols for exact fractions."""
    return code.module(WINDOW, Fraction=lambda value: SymbolicValue(value.term, value.ask))


def neighbouring_doubles(length: Fraction) -> dict[str, Fraction]:
    """The doubles below and above that length; both it, where it is one."""
    return dict(zip(("below", "above"), map(Fraction, adjacent_doubles(length)), strict=True))


def rounding_assumptions(length: Fraction) -> dict[str, str]:
    """Assume that `rounded` keeps order and that TwoSum computes the rounding error."""
    share = f"(rounded (- (rounded {TIME_DIFFERENCE}) later))"
    corrected = f"(rounded (- later (rounded (- (rounded {TIME_DIFFERENCE}) {share}))))"
    error = f"(rounded (- {corrected} (rounded (+ earlier {share}))))"
    return {
        **{
            f"rounding-keeps-order.{name}": f"(and (=> (<= {TIME_DIFFERENCE} {smt_literal(one)})"
            f" (<= (rounded {TIME_DIFFERENCE}) {smt_literal(one)}))"
            f" (=> (>= {TIME_DIFFERENCE} {smt_literal(one)})"
            f" (>= (rounded {TIME_DIFFERENCE}) {smt_literal(one)})))"
            for name, one in neighbouring_doubles(length).items()
        },
        "twosum": f"(= {error} (- {TIME_DIFFERENCE} (rounded {TIME_DIFFERENCE})))",
    }

"""Code that computes with reals, explored: what stands for its numbers, its vectors, and for `math`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import reduce
from typing import Any, Final

from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, term_of

SIZE: Final = "(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))"
POLYNOMIALS: Final = "QF_NRA"  # cvc5 then decides by coverings

AXES: Final = "xyz"


class SymbolicReal(SymbolicValue):
    """A real; powers are products."""

    __slots__ = ()

    def _apply(self, operator: str, *parts: Any) -> SymbolicReal:
        return SymbolicReal(SymbolicValue._apply(self, operator, *parts).term, self.ask)

    def __pow__(self, power: int) -> Any:
        return self if power == 1 else self * self ** (power - 1)

    def __truediv__(self, other: float) -> SymbolicReal:
        return self._apply("/", self, other)


def max_stub(*values: Any) -> Any:
    """Stands for `max`."""
    return _choose_extremum(values, lambda first, other, found: first._apply("<=", other, found))


def min_stub(*values: Any) -> Any:
    """Stands for `min`."""
    return _choose_extremum(values, lambda first, other, found: first._apply("<=", found, other))


def _choose_extremum(
    values: tuple[Any, ...], stays: Callable[[SymbolicValue, Any, Any], SymbolicValue]
) -> Any:
    """Of them, or of those in the only one of them, what each other one lets stay."""
    several = list(values[0]) if len(values) == 1 else list(values)
    first = next(one for one in several if isinstance(one, SymbolicValue))
    return reduce(lambda found, other: first._apply("ite", stays(first, other, found), found, other), several)


LARGER_DEFINITION: Final = "(define-fun larger ((x Real) (y Real)) Real (ite (<= y x) x y))"


def max_of_many_stub(values: Iterable[SymbolicReal]) -> SymbolicReal:
    """Stands for `max` of many, by `LARGER_DEFINITION`: `max_stub` would write each of them many times."""
    return reduce(lambda one, other: one._apply("larger", one, other), values)


def norm_stub(ask: DecideBranch, *parts: Any) -> SymbolicReal:
    """Stands for `hypot` and `norm`: the length of a vector, of which lemmas speak."""
    return SymbolicReal(f"(norm {' '.join(map(term_of, parts))})", ask)


def vector_terms(name: str) -> tuple[str, ...]:
    """The terms of its coordinates."""
    return tuple(f"{name}.{axis}" for axis in AXES)


def symbolic_vector(ask: DecideBranch, name: str) -> tuple[SymbolicReal, ...]:
    """Its coordinates."""
    return tuple(SymbolicReal(one, ask) for one in vector_terms(name))


def declare_reals(*names: str) -> tuple[str, ...]:
    """Declarations of reals."""
    return tuple(f"(declare-const {name} Real)" for name in names)


def declare_vectors(*names: str) -> tuple[str, ...]:
    """Declarations of the coordinates of vectors."""
    return tuple(line for name in names for line in declare_reals(*vector_terms(name)))


def cross(a: tuple[str, ...], b: tuple[str, ...]) -> tuple[str, ...]:
    """The vector product of two."""
    pairs = ((1, 2), (2, 0), (0, 1))
    return tuple(f"(- (* {a[i]} {b[j]}) (* {a[j]} {b[i]}))" for i, j in pairs)


def minus(a: tuple[str, ...], b: tuple[str, ...]) -> tuple[str, ...]:
    """The difference of two."""
    return tuple(f"(- {one} {other})" for one, other in zip(a, b, strict=True))


def dot(a: tuple[str, ...], b: tuple[str, ...]) -> str:
    """The scalar product of two."""
    return sum_terms(f"(* {one} {other})" for one, other in zip(a, b, strict=True))


def sum_terms(summands: Iterable[str]) -> str:
    """The sum of reals."""
    several = list(summands)
    return (
        smt_literal(Fraction(0))
        if not several
        else several[0]
        if len(several) == 1
        else f"(+ {' '.join(several)})"
    )

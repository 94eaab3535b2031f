"""Code that computes with reals, explored: what stands for its numbers, its vectors, and for `math`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import reduce
from typing import Any, Final

from aeros.spec.theorems.smtlib import literal
from aeros.spec.theorems.symbolic_execution import Ask, Symbol, term_of

SIZE: Final = "(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))"
POLYNOMIALS: Final = "QF_NRA"  # cvc5 then decides by coverings

AXES: Final = "xyz"


class Real(Symbol):
    """A real; powers are products."""

    __slots__ = ()

    def _with(self, operator: str, *parts: Any) -> Real:
        return Real(Symbol._with(self, operator, *parts).term, self.ask)

    def __pow__(self, power: int) -> Any:
        return self if power == 1 else self * self ** (power - 1)

    def __truediv__(self, other: float) -> Real:
        return self._with("/", self, other)


def largest(*values: Any) -> Any:
    """Stands for `max`."""
    return _chosen(values, lambda first, other, found: first._with("<=", other, found))


def smallest(*values: Any) -> Any:
    """Stands for `min`."""
    return _chosen(values, lambda first, other, found: first._with("<=", found, other))


def _chosen(values: tuple[Any, ...], stays: Callable[[Symbol, Any, Any], Symbol]) -> Any:
    """Of them, or of those in the only one of them, what each other one lets stay."""
    several = list(values[0]) if len(values) == 1 else list(values)
    first = next(one for one in several if isinstance(one, Symbol))
    return reduce(lambda found, other: first._with("ite", stays(first, other, found), found, other), several)


LARGER: Final = "(define-fun larger ((x Real) (y Real)) Real (ite (<= y x) x y))"


def largest_of(values: Iterable[Real]) -> Real:
    """Stands for `max` of many, by `LARGER`: `largest` would write each of them many times."""
    return reduce(lambda one, other: one._with("larger", one, other), values)


def norm_of(ask: Ask, *parts: Any) -> Real:
    """Stands for `hypot` and `norm`: the length of a vector, of which lemmas speak."""
    return Real(f"(norm {' '.join(map(term_of, parts))})", ask)


def vector(name: str) -> tuple[str, ...]:
    """The terms of its coordinates."""
    return tuple(f"{name}.{axis}" for axis in AXES)


def symbols(ask: Ask, name: str) -> tuple[Real, ...]:
    """Its coordinates."""
    return tuple(Real(one, ask) for one in vector(name))


def declared(*names: str) -> tuple[str, ...]:
    """Declarations of reals."""
    return tuple(f"(declare-const {name} Real)" for name in names)


def declared_vectors(*names: str) -> tuple[str, ...]:
    """Declarations of the coordinates of vectors."""
    return tuple(line for name in names for line in declared(*vector(name)))


def cross(a: tuple[str, ...], b: tuple[str, ...]) -> tuple[str, ...]:
    """The vector product of two."""
    pairs = ((1, 2), (2, 0), (0, 1))
    return tuple(f"(- (* {a[i]} {b[j]}) (* {a[j]} {b[i]}))" for i, j in pairs)


def minus(a: tuple[str, ...], b: tuple[str, ...]) -> tuple[str, ...]:
    """The difference of two."""
    return tuple(f"(- {one} {other})" for one, other in zip(a, b, strict=True))


def dot(a: tuple[str, ...], b: tuple[str, ...]) -> str:
    """The scalar product of two."""
    return total(f"(* {one} {other})" for one, other in zip(a, b, strict=True))


def total(summands: Iterable[str]) -> str:
    """The sum of reals."""
    several = list(summands)
    return (
        literal(Fraction(0))
        if not several
        else several[0]
        if len(several) == 1
        else f"(+ {' '.join(several)})"
    )

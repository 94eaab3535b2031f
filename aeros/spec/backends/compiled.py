"""Code generation from terms to Python functions, used for each action; identical to the exact semantics.

A filtered exact predicate: reals are evaluated in doubles, and every comparison carries a bound on the
rounding error of its two sides. The bound is derived here, at compile time, from the declared ranges of the
variables. Outside the bound, the sign of the difference is certain and decides at once; inside it, the exact
interpreter decides. So the answer never differs from `semantics.evaluate`.

Error model (IEEE 754 double, round to nearest, no contraction: CPython performs each operation on its own):
fl(a+b) = (a+b)(1+d), fl(ab) = ab(1+d) + e with |d| <= U, |e| <= ETA.
Source: N. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., (2.4) and (2.8).
"""

from __future__ import annotations

import marshal
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from types import CodeType
from typing import Any, Literal

from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import RealType

UNIT_ROUNDOFF = Fraction(1, 2**53)
UNDERFLOW_ERROR = Fraction(1, 2**1075)
_LARGEST = Fraction(10) ** 300  # beyond it a double could overflow: such a comparison is always exact
_MAX_INLINE_NESTING = 30  # levels of the term, two brackets each at most; CPython's parser takes 200 brackets

Ranges = Mapping[str, tuple[Fraction, Fraction]]
"""Closed range (SI) of each real scalar variable; the caller has checked that values are inside."""

Predicate = Callable[[Mapping[str, Any]], bool]
"""Function that decides one condition from float, bool or str by name of the scalar variable."""


@dataclass(frozen=True, slots=True)
class CompiledConditions:
    """Function that decides several conditions at once.

    Attributes:
        argument_names: the scalar variables that the conditions depend on.
        evaluate: takes float, bool or str of each of these, in that order; returns the truth of each
            condition.
    """

    argument_names: tuple[str, ...]
    evaluate: Callable[..., tuple[bool, ...]]


@dataclass(frozen=True, slots=True)
class _RealCode:
    """Python code for a real: |computed| <= magnitude and |computed - exact| <= error.

    Attributes:
        peak: bound on every intermediate result; the other bounds hold only where it is far from overflow.
    """

    code: str
    magnitude: Fraction
    error: Fraction
    peak: Fraction


def bytecode_of(source: str, mode: Literal["eval", "exec"]) -> CodeType:
    """Compile generated source; the same text is compiled once in a process.

    Args:
        source: Python source code.
        mode: `eval` for one expression, `exec` for statements.

    Returns:
        New code, which knows no globals yet. CPython adapts code to the globals that it runs with, so
        functions that shared code would slow each other down.
    """
    code: CodeType = marshal.loads(_marshalled(source, mode))  # noqa: S302
    return code


@lru_cache(maxsize=4096)
def _marshalled(source: str, mode: Literal["eval", "exec"]) -> bytes:
    return marshal.dumps(compile(source, "<generated>", mode))


def compile_condition(term: t.Term, ranges: Ranges) -> Predicate:
    """Compile a condition.

    Args:
        term: boolean term without past-time operators.
        ranges: closed range (SI) of each real scalar variable; the bounds on rounding errors follow from it.

    Returns:
        A function that is true exactly where `term` holds, for all values inside `ranges`.
    """
    generator = _CodeGenerator(ranges)
    return generator.function("v", generator.condition(lower(term)))


def compile_conditions(terms: Iterable[t.Term], ranges: Ranges) -> CompiledConditions:
    """Compile several conditions into one function.

    Args:
        terms: boolean terms without past-time operators.
        ranges: closed range (SI) of each real scalar variable.

    Returns:
        The function, exact for all values inside `ranges`, and the names of its arguments.
    """
    lowered = [lower(term) for term in terms]
    read = tuple(dict.fromkeys(name for term in lowered for name in t.variables_of(term)))
    local = {name: f"x{number}" for number, name in enumerate(read)}
    generator = _CodeGenerator(ranges, local)
    codes = [f"{generator.condition(term)}," for term in lowered]
    return CompiledConditions(read, generator.function(", ".join(local.values()), f"({' '.join(codes)})"))


def inline_conditions(
    terms: Iterable[t.Term], ranges: Ranges, local: Mapping[str, str]
) -> tuple[list[str], Mapping[str, Any]]:
    """Generate code of conditions for use inside a larger generated function.

    Args:
        terms: boolean terms without past-time operators.
        ranges: closed range (SI) of each real scalar variable.
        local: for each scalar variable, the local variable of that function that has its value, inside its
            range.

    Returns:
        An expression for each term, true exactly where it holds; and the global names that the expressions
        use.
    """
    generator = _CodeGenerator(ranges, local)
    return [generator.condition(lower(term)) for term in terms], generator.names


class _CodeGenerator:
    """Code generator. The code finds values in a mapping `v`, or in `local` variables."""

    def __init__(self, ranges: Ranges, local: Mapping[str, str] | None = None) -> None:
        self._ranges = ranges
        self._local = local
        self._heights: dict[int, int] = {}
        # `repr` writes an infinite bound as `inf`.
        self.names: dict[str, Any] = {
            "__builtins__": {},
            "abs": abs,
            "inf": math.inf,
            "max": max,
            "min": min,
        }

    def function(self, parameters: str, code: str) -> Callable[..., Any]:
        """Compile `code` as a function of these parameters."""
        # The source is built from typed terms alone: names are quoted, numbers are repr of floats.
        source = f"lambda {parameters}: {code}"
        function: Callable[..., Any] = eval(bytecode_of(source, "eval"), self.names)  # noqa: S307
        return function

    def condition(self, term: t.Term) -> str:
        return self._as_helper_call(term, self._condition(term))

    def _as_helper_call(self, term: t.Term, code: str) -> str:
        """Return `code`, or at every `_MAX_INLINE_NESTING`th level a call of it as a function of its own."""
        if self._height(term) % _MAX_INLINE_NESTING:
            return code
        part, values = f"part{len(self.names)}", self._values(term)
        self.names[part] = self.function(values, code)
        return f"{part}({values})"

    def _value(self, name: str) -> str:
        return f"v[{name!r}]" if self._local is None else self._local[name]

    def _values(self, term: t.Term) -> str:
        """Return the parameters of a function over the variables of `term`, which are also its arguments."""
        return "v" if self._local is None else ", ".join(self._local[name] for name in t.variables_of(term))

    def _height(self, term: t.Term) -> int:
        if id(term) not in self._heights:
            self._heights[id(term)] = 1 + max(map(self._height, t.children(term)), default=0)
        return self._heights[id(term)]

    def _condition(self, term: t.Term) -> str:
        match term:
            case t.Literal(value=value):
                return repr(value)
            case t.Variable(name=name):
                return self._value(name)
            case t.Not(operand=operand):
                return f"(not {self.condition(operand)})"
            case t.And(operands=operands):
                return "(" + " and ".join(map(self.condition, operands)) + ")"
            case t.Or(operands=operands):
                return "(" + " or ".join(map(self.condition, operands)) + ")"
            case t.Conditional(condition=condition, then=then, otherwise=otherwise):
                parts = [self.condition(part) for part in (then, condition, otherwise)]
                return f"({parts[0]} if {parts[1]} else {parts[2]})"
            case t.Compare():
                return self._comparison(term)
            case _:
                raise AssertionError(f"not a core condition: {term}")

    def _comparison(self, term: t.Compare) -> str:
        left, right = term.left, term.right
        if not _is_real(left):  # nor is the other side
            return f"({self.condition(left)} == {self.condition(right)})"
        a, b = self._real(left), self._real(right)
        match left, right:
            case _, t.Literal(value=Fraction() as constant) if a.error == 0:
                return _compare_to_constant(a.code, term.op, constant)
            case t.Literal(value=Fraction() as constant), _ if b.error == 0:
                return _compare_to_constant(b.code, term.op, constant, flipped=True)
        if a.error == b.error == 0:
            return f"({a.code} {term.op} {b.code})"
        return self._filtered_comparison(term, a, b)

    def _filtered_comparison(self, term: t.Compare, a: _RealCode, b: _RealCode) -> str:
        """Decide from the computed difference where |difference| exceeds its error bound, else exactly."""
        number = len(self.names)
        exact = f"exact{number}({self._values(term)})"
        names = tuple(t.variables_of(term))
        if self._local is None:
            self.names[f"exact{number}"] = lambda values: is_true(term, _exact_values(names, values))
        else:
            self.names[f"exact{number}"] = lambda *values: is_true(
                term, _exact_values(names, dict(zip(names, values, strict=True)))
            )
        if max(a.peak, b.peak, a.magnitude + b.magnitude) > _LARGEST:
            return exact
        bound = _round_up(a.error + b.error + UNIT_ROUNDOFF * (a.magnitude + b.magnitude))
        difference = f"(d{number} := {a.code} - {b.code})"
        if term.op == "==":
            return f"(-{bound!r} <= {difference} <= {bound!r} and {exact})"
        return f"({difference} < -{bound!r} or (d{number} <= {bound!r} and {exact}))"

    def _real(self, term: t.Term) -> _RealCode:
        real = self._arithmetic(term)
        return replace(real, code=self._as_helper_call(term, real.code))

    def _arithmetic(self, term: t.Term) -> _RealCode:
        match term:
            case t.Literal(value=Fraction() as exact):
                if abs(exact) > _LARGEST:
                    return _RealCode("0.0", Fraction(0), abs(exact), abs(exact))
                computed = float(exact)
                size = abs(Fraction(computed))
                return _RealCode(f"({computed!r})", size, abs(Fraction(computed) - exact), size)
            case t.Variable(name=name):
                lower_, upper = self._ranges[name]
                size = max(abs(lower_), abs(upper))
                return _RealCode(self._value(name), size, Fraction(0), size)
            case t.Add(left=left, right=right):
                a, b = self._real(left), self._real(right)
                total = a.magnitude + b.magnitude
                error = a.error + b.error + UNIT_ROUNDOFF * total
                return _derived_real(f"({a.code} + {b.code})", total * (1 + UNIT_ROUNDOFF), error, a, b)
            case t.Multiply(left=left, right=right):
                a, b = self._real(left), self._real(right)
                total = a.magnitude * b.magnitude
                carried = a.magnitude * b.error + b.magnitude * a.error + a.error * b.error
                error = carried + UNIT_ROUNDOFF * total + UNDERFLOW_ERROR
                return _derived_real(
                    f"({a.code} * {b.code})", total * (1 + UNIT_ROUNDOFF) + UNDERFLOW_ERROR, error, a, b
                )
            case t.Extremum(kind=kind, left=left, right=right):
                a, b = self._real(left), self._real(right)
                return _combine_extremum(f"{kind}({a.code}, {b.code})", a, b)
            case t.Absolute(operand=operand):
                a = self._real(operand)
                return replace(a, code=f"abs({a.code})")
            case t.Conditional(condition=condition, then=then, otherwise=otherwise):
                a, b = self._real(then), self._real(otherwise)
                code = f"({a.code} if {self.condition(condition)} else {b.code})"
                return _combine_extremum(code, a, b)
            case _:
                raise AssertionError(f"not a core real: {term}")


def _derived_real(code: str, magnitude: Fraction, error: Fraction, a: _RealCode, b: _RealCode) -> _RealCode:
    return _RealCode(code, magnitude, error, max(a.peak, b.peak, magnitude))


def _combine_extremum(code: str, a: _RealCode, b: _RealCode) -> _RealCode:
    """Bound one of `a` and `b`, or a value as close to one as the worse of them is to its exact value."""
    return _derived_real(code, max(a.magnitude, b.magnitude), max(a.error, b.error), a, b)


def _compare_to_constant(code: str, op: str, constant: Fraction, *, flipped: bool = False) -> str:
    """Compare a double to a rational exactly: the rational is rounded so that the answer is the same."""
    below, above = adjacent_doubles(constant)
    if op == "==":
        return f"({code} == {below!r})" if below == above else "False"
    if op == "<=":
        return f"({code} >= {above!r})" if flipped else f"({code} <= {below!r})"
    return f"({code} > {below!r})" if flipped else f"({code} < {above!r})"


def _round_up(value: Fraction) -> float:
    return adjacent_doubles(value)[1]


def _is_real(term: t.Term) -> bool:
    match term:
        case t.Literal(type=type_) | t.Variable(type=type_):
            return isinstance(type_, RealType)
        case t.Add() | t.Multiply() | t.Extremum() | t.Absolute():
            return True
        case t.Conditional(then=then):
            return _is_real(then)
        case _:
            return False


def _exact_values(names: tuple[str, ...], values: Mapping[str, Any]) -> dict[str, Any]:
    given = ((name, values[name]) for name in names)
    return {name: Fraction(value) if type(value) is float else value for name, value in given}

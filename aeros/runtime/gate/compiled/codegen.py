"""Writes functions that check the form of values, line by line, and compute on local variables.

What such a function accepts has the form that `form.py` asks for; where a check fails it leaves, and
whoever called it does without its answer or finds the reasons by `form.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from aeros.runtime.gate.value_check import Form, Scalars, doubles_in_range
from aeros.runtime.ports import Reading
from aeros.spec.backends.compiled import inline_conditions
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.model.model import Declared, ranges_of

EXACT_INTEGERS = 2**53


def _whole(value: Any) -> float:
    """A whole number as the double that it is; of anything else NaN, which is in no range."""
    if type(value) is int and -EXACT_INTEGERS <= value <= EXACT_INTEGERS:
        return float(value)
    return float("nan")


class Writer:
    """The lines of a function; each check that fails leaves by the statement `leaving`.

    local: the local variable that holds each scalar variable's value.
    names: what the lines refer to.
    implied: scalar variables whose range needs no check, as something that is decided after it implies it.
    """

    leaving = "return None"

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.local: dict[str, str] = {}
        self.implied: frozenset[str] = frozenset()
        self.names: dict[str, Any] = {
            "__builtins__": {},
            "AttributeError": AttributeError,
            "IndexError": IndexError,
            "KeyError": KeyError,
            "Reading": Reading,
            "dict": dict,
            "float": float,
            "int": int,
            "len": len,
            "list": list,
            "str": str,
            "tuple": tuple,
            "type": type,
            "whole": _whole,
        }

    def line(self, code: str) -> None:
        """One more line of the body."""
        self.lines.append(f"  {code}")

    def indent(self, start: int) -> None:
        """The lines from `start` on as the body of what stands before them."""
        self.lines[start:] = [f"  {line}" for line in self.lines[start:]]

    def require(self, code: str) -> None:
        """Leave where this does not hold."""
        self.line(f"if not ({code}): {self.leaving}")

    def conditions(self, terms: Sequence[t.Term], declared: Iterable[Declared]) -> list[str]:
        """Code for each condition, on local variables."""
        used = frozenset().union(*map(t.variables_of, terms))
        ranges = ranges_of(one for one in declared if one.name in used)
        codes, names = inline_conditions(terms, ranges, self.local)
        self.names |= names
        return codes

    def function(self, name: str, source: Sequence[str]) -> Callable[..., Any]:
        """The function of that name that `source` defines."""
        # Written from declarations alone: names are quoted, numbers are repr of numbers.
        exec("\n".join(source), self.names)  # noqa: S102
        function: Callable[..., Any] = self.names[name]
        return function

    def taking(self, form: Form) -> Callable[[Any], Scalars | None]:
        """A function that takes a value apart as `form` does, and gives None where that finds a fault."""
        self.take(form, "value")
        scalars = ", ".join(f"{name!r}: {self.local[name]}" for name in form.names)
        self.line(f"return {{{scalars}}}")
        return self.function("taking", ["def taking(value):", *self.lines])

    def reading(self, form: Form) -> None:
        """Form and time of `reading`, which is not from the future of `exactly`.

        Most readings share one time, which is then checked once: `time` is `measured` as a double, and
        `age` its distance from `exactly`.  Raises IndexError for a reading with nothing in it.
        """
        self.require("type(reading) is Reading")
        self.line("if reading.time is not measured:")
        start = len(self.lines)
        self.line("number = reading.time if type(reading.time) is float else whole(reading.time)")
        self.require(f"{-EXACT_INTEGERS} <= number <= exactly")
        self.line("time, age = number, exactly - number")
        self.line("measured = reading.time")
        self.indent(start)
        self.take(form, "reading.value")

    def take(self, form: Form, code: str) -> str:
        """The value of `code` as local variables, one for each scalar; code for it as it is executed."""
        scalars = []
        for name in form.names:
            scalars.append(f"x{len(self.local)}")
            self.local[name] = scalars[-1]
        if not isinstance(form.declared.variable.type, VectorType | FamilyType):
            self.line(f"{scalars[0]} = {code}")
            self._scalar(form.declared, form.names[0])
            return scalars[0]
        listed = ", ".join(scalars) + ","
        self.line(f"several = {code}")
        self.require("type(several) is tuple or type(several) is list")
        self.require(f"len(several) == {len(scalars)}")
        self.line(f"{listed} = several")
        for scalar in form.names:
            self._scalar(form.declared, scalar)
        return f"({listed})"

    def _scalar(self, declared: Declared, name: str) -> None:
        type_, local = declared.variable.type, self.local[name]
        match type_.element if isinstance(type_, FamilyType) else type_:
            case BoolType():
                self.require(f"{local} is True or {local} is False")
            case EnumType(members=members):
                self.require(f"type({local}) is str and {local} in {members!r}")
            case RealType() | VectorType() as real:
                least, most = doubles_in_range(declared)
                whole = f" and {local}.is_integer()" if isinstance(real, IntegerType) else ""
                self.line(f"if type({local}) is not float: {local} = whole({local})")
                if name not in self.implied:
                    self.require(f"{least!r} <= {local} <= {most!r}{whole}")

"""Writes functions that check the form of values, line by line, and compute on local variables.

What such a function accepts has the form that `checker.py` asks for; where a check fails it leaves, and
whoever called it does without its answer or finds the reasons by `checker.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from aeros.runtime.gate.value_check import Scalars, ValueChecker, doubles_in_range
from aeros.runtime.ports import Reading
from aeros.spec.backends.compiled import inline_conditions
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.model.model import Declared, ranges_of

EXACT_INTEGERS = 2**53


def _integer_as_double(value: Any) -> float:
    """A whole number as the double that it is; of anything else NaN, which is in no range."""
    if type(value) is int and -EXACT_INTEGERS <= value <= EXACT_INTEGERS:
        return float(value)
    return float("nan")


class FunctionWriter:
    """The lines of a function; each check that fails leaves by the statement `exit_statement`.

    local: the local variable that holds each scalar variable's value.
    names: what the lines refer to.
    implied: scalar variables whose range needs no check, as something that is decided after it implies it.
    """

    exit_statement = "return None"

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
            "whole": _integer_as_double,
        }

    def add_line(self, code: str) -> None:
        """One more line of the body."""
        self.lines.append(f"  {code}")

    def indent(self, start: int) -> None:
        """The lines from `start` on as the body of what stands before them."""
        self.lines[start:] = [f"  {line}" for line in self.lines[start:]]

    def write_guard(self, code: str) -> None:
        """Leave where this does not hold."""
        self.add_line(f"if not ({code}): {self.exit_statement}")

    def condition_codes(self, terms: Sequence[t.Term], declared: Iterable[Declared]) -> list[str]:
        """Code for each condition, on local variables."""
        used = frozenset().union(*map(t.variables_of, terms))
        ranges = ranges_of(one for one in declared if one.name in used)
        codes, names = inline_conditions(terms, ranges, self.local)
        self.names |= names
        return codes

    def compile_function(self, name: str, source: Sequence[str]) -> Callable[..., Any]:
        """The function of that name that `source` defines."""
        # Written from declarations alone: names are quoted, numbers are repr of numbers.
        exec("\n".join(source), self.names)  # noqa: S102
        function: Callable[..., Any] = self.names[name]
        return function

    def build_unpacker(self, checker: ValueChecker) -> Callable[[Any], Scalars | None]:
        """A function that takes a value apart as `checker` does, and gives None where that finds a fault."""
        self.write_unpack(checker, "value")
        scalars = ", ".join(f"{name!r}: {self.local[name]}" for name in checker.names)
        self.add_line(f"return {{{scalars}}}")
        return self.compile_function("taking", ["def taking(value):", *self.lines])

    def write_reading(self, checker: ValueChecker) -> None:
        """Form and time of `write_reading`, which is not from the future of `exactly`.

        Most readings share one time, which is then checked once: `time` is `measured` as a double, and
        `age` its distance from `exactly`.  Raises IndexError for a reading with nothing in it.
        """
        self.write_guard("type(reading) is Reading")
        self.add_line("if reading.time is not measured:")
        start = len(self.lines)
        self.add_line("number = reading.time if type(reading.time) is float else whole(reading.time)")
        self.write_guard(f"{-EXACT_INTEGERS} <= number <= exactly")
        self.add_line("time, age = number, exactly - number")
        self.add_line("measured = reading.time")
        self.indent(start)
        self.write_unpack(checker, "reading.value")

    def write_unpack(self, checker: ValueChecker, code: str) -> str:
        """The value of `code` as local variables, one for each scalar; code for it as it is executed."""
        scalars = []
        for name in checker.names:
            scalars.append(f"x{len(self.local)}")
            self.local[name] = scalars[-1]
        if not isinstance(checker.declared.variable.type, VectorType | FamilyType):
            self.add_line(f"{scalars[0]} = {code}")
            self._scalar(checker.declared, checker.names[0])
            return scalars[0]
        listed = ", ".join(scalars) + ","
        self.add_line(f"several = {code}")
        self.write_guard("type(several) is tuple or type(several) is list")
        self.write_guard(f"len(several) == {len(scalars)}")
        self.add_line(f"{listed} = several")
        for scalar in checker.names:
            self._scalar(checker.declared, scalar)
        return f"({listed})"

    def _scalar(self, declared: Declared, name: str) -> None:
        type_, local = declared.variable.type, self.local[name]
        match type_.element if isinstance(type_, FamilyType) else type_:
            case BoolType():
                self.write_guard(f"{local} is True or {local} is False")
            case EnumType(members=members):
                self.write_guard(f"type({local}) is str and {local} in {members!r}")
            case RealType() | VectorType() as real:
                least, most = doubles_in_range(declared)
                whole = f" and {local}.is_integer()" if isinstance(real, IntegerType) else ""
                self.add_line(f"if type({local}) is not float: {local} = whole({local})")
                if name not in self.implied:
                    self.write_guard(f"{least!r} <= {local} <= {most!r}{whole}")

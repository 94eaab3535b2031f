"""Code generation of functions that check values and evaluate conditions on local variables.

A generated function accepts exactly the values that `value_check.py` accepts. If a check fails it returns
early; the caller then does without its result, or finds the reasons with `value_check.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import nan
from typing import Any

from aeros.runtime.gate.value_check import Scalars, ValueChecker, doubles_in_range
from aeros.runtime.ports import Reading
from aeros.spec.backends.compiled import bytecode_of, inline_conditions
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.model.variables import Declared, ranges_of

EXACT_INTEGERS = 2**53


def double_of(code: str) -> str:
    """Write the conversion of a number to the equal double; NaN, which is in no range, for anything else.

    Args:
        code: expression of the number, without side effects.

    Returns:
        The expression of the double.
    """
    whole = f"type({code}) is int and {-EXACT_INTEGERS} <= {code} <= {EXACT_INTEGERS}"
    return f"{code} if type({code}) is float else float({code}) if {whole} else nan"


class FunctionWriter:
    """Writer of a function, line by line; each check that fails leaves it by the statement `exit_statement`.

    Attributes:
        lines: the body so far.
        local: the local variable that holds each scalar variable's value.
        names: the globals of the function.
        implied: scalar variables whose range needs no check, because a later condition implies it.
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
            "nan": nan,
            "str": str,
            "tuple": tuple,
            "type": type,
        }

    def add_line(self, code: str) -> None:
        """Add one line to the body.

        Args:
            code: the line, without its indentation.
        """
        self.lines.append(f"  {code}")

    def indent(self, start: int) -> None:
        """Indent the lines from `start` on, so that they become the body of the line before them.

        Args:
            start: index of the first line to indent.
        """
        self.lines[start:] = [f"  {line}" for line in self.lines[start:]]

    def write_guard(self, code: str) -> None:
        """Add a check that leaves the function if a condition is false.

        Args:
            code: the condition, as a Python expression.
        """
        self.add_line(f"if not ({code}): {self.exit_statement}")

    def condition_codes(self, terms: Sequence[t.Term], declared: Iterable[Declared]) -> list[str]:
        """Translate conditions to Python expressions on the local variables.

        Args:
            terms: the conditions.
            declared: the variables that they may read.

        Returns:
            One expression for each condition.
        """
        used = frozenset().union(*map(t.variables_of, terms))
        ranges = ranges_of(one for one in declared if one.name in used)
        codes, names = inline_conditions(terms, ranges, self.local)
        self.names |= names
        return codes

    def compile_function(self, name: str, source: Sequence[str]) -> Callable[..., Any]:
        """Compile source code that defines a function.

        Args:
            name: the name of the function.
            source: the lines of its definition.

        Returns:
            The function.
        """
        # The source comes from declarations alone: names are quoted, numbers are reprs of numbers.
        exec(bytecode_of("\n".join(source), "exec"), self.names)  # noqa: S102
        function: Callable[..., Any] = self.names[name]
        return function

    def build_unpacker(self, checker: ValueChecker) -> Callable[[Any], Scalars | None]:
        """Write and compile a function that unpacks values of one variable.

        Args:
            checker: the variable.

        Returns:
            A function from a value to its scalars, or to None if `checker` would find a fault.
        """
        self.write_unpack(checker, "value")
        scalars = ", ".join(f"{name!r}: {self.local[name]}" for name in checker.names)
        self.add_line(f"return {{{scalars}}}")
        return self.compile_function("taking", ["def taking(value):", *self.lines])

    def write_reading(self, checker: ValueChecker) -> None:
        """Add checks of form and time of the local `reading`, which must not be later than `exactly`.

        Most readings share one time, which is then checked only once: the local `measured` is that time
        object, `time` the same as a double, and `age` its distance from `exactly`.

        Args:
            checker: the measured variable.
        """
        self.write_guard(f"type(reading) is Reading and len(reading) == {len(Reading._fields)}")
        self.add_line("moment = reading.time")
        self.add_line("if moment is not measured:")
        start = len(self.lines)
        self.add_line(f"number = {double_of('moment')}")
        self.write_guard(f"{-EXACT_INTEGERS} <= number <= exactly")
        self.add_line("time, age = number, exactly - number")
        self.add_line("measured = moment")
        self.indent(start)
        self.write_unpack(checker, "reading.value")

    def write_unpack(self, checker: ValueChecker, code: str) -> str:
        """Add code that checks a value and stores its scalars in local variables.

        Args:
            checker: the variable.
            code: an expression for the value.

        Returns:
            An expression for the checked value in the form that plants expect.
        """
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
                self.add_line(f"if type({local}) is not float: {local} = {double_of(local)}")
                if name not in self.implied:
                    self.write_guard(f"{least!r} <= {local} <= {most!r}{whole}")

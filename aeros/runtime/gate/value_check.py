"""Form of a value: exact type, finite, in range, fresh. Anything else is a reason to deny.

Types are compared exactly: a `bool` is no number, and a subclass of `float` could have operators of its own.
A double is the rational it denotes, and ranges are compared exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from aeros.runtime.gate.decision import Reason
from aeros.runtime.ports import Reading
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.variables import Declared

_EXACT_INTEGERS = 2**53  # every whole number up to here is a double

Scalars = dict[str, Any]
"""float, bool or str by scalar variable, in the form that the back ends expect."""


def is_reading(given: Any) -> bool:
    """Return True if an object is a `Reading` with exactly its fields; generated code checks the same.

    `tuple.__new__` makes readings of any length.

    Args:
        given: any object.

    Returns:
        True if it is well-formed.
    """
    return type(given) is Reading and len(given) == len(Reading._fields)


class ValueChecker:
    """Checker of one declared variable's values, which also splits them into scalars.

    Attributes:
        declared: the variable.
        names: its scalar variables, in order.
        surely_fresh: a rounded age below this double (s) is within the variable's `max_age`.
    """

    def __init__(self, declared: Declared) -> None:
        self.declared = declared
        self.names = tuple(scalar.name for scalar in scalar_variables(declared.variable))
        self._is_compound = isinstance(declared.variable.type, VectorType | FamilyType)
        self._check = _scalar_check(declared)
        limit = declared.max_age
        # Rounding keeps order: a difference of times that is rounded to less than a double up to the
        # limit is itself less than that double.
        self.surely_fresh = math.inf if limit is None else adjacent_doubles(limit)[0]

    def unpack(self, value: Any, into: Scalars) -> Reason | None:
        """Check a value and split it into scalars.

        Args:
            value: any object.
            into: receives the scalars; of a faulty value perhaps some, never all.

        Returns:
            The reason why it is not a value of this variable, or None.
        """
        if not self._is_compound:
            return self._unpack_scalar(self.names[0], value, into)
        if type(value) not in (tuple, list) or len(value) != len(self.names):
            name = self.declared.name
            return Reason("AE704", name, f"`{name}` is not a list of {len(self.names)} values")
        for scalar, part in zip(self.names, value, strict=True):
            fault = self._unpack_scalar(scalar, part, into)
            if fault is not None:
                return fault
        return None

    def _unpack_scalar(self, scalar: str, value: Any, into: Scalars) -> Reason | None:
        checked, fault = self._check(value)
        if fault is not None:
            return Reason(fault[0], self.declared.name, f"`{scalar}` {fault[1]}")
        into[scalar] = checked
        return None


_ScalarCheck = tuple[Any, tuple[str, str] | None]


def _scalar_check(declared: Declared) -> Callable[[Any], _ScalarCheck]:
    type_ = declared.variable.type
    element = type_.element if isinstance(type_, FamilyType) else type_
    match element:
        case BoolType():
            return _check_bool
        case EnumType():
            return lambda value: _check_member(value, element)
        case RealType() | VectorType():
            return _real_check(declared)


def _check_bool(value: Any) -> _ScalarCheck:
    return (value, None) if type(value) is bool else (None, ("AE704", "is not true or false"))


def _check_member(value: Any, enum: EnumType) -> _ScalarCheck:
    if type(value) is str and value in enum.members:
        return value, None
    return None, ("AE704", f"is not a member of {enum.name}")


def _real_check(declared: Declared) -> Callable[[Any], _ScalarCheck]:
    low, high = declared.range or (Fraction(0), Fraction(0))
    least, most = doubles_in_range(declared)
    bounds = f"{format_quantity(low, declared.unit)} to {format_quantity(high, declared.unit)}"
    type_ = declared.variable.type
    whole = isinstance(type_.element if isinstance(type_, FamilyType) else type_, IntegerType)

    def check(value: Any) -> _ScalarCheck:
        if type(value) is int and -_EXACT_INTEGERS <= value <= _EXACT_INTEGERS:
            value = float(value)
        if type(value) is not float:
            return None, ("AE704", "is not a number")
        if not math.isfinite(value):
            return None, ("AE704", "is not finite")
        if not least <= value <= most:
            return None, ("AE705", f"is outside {bounds}")
        if whole and not value.is_integer():
            return None, ("AE704", "is not a whole number")
        return value, None

    return check


def doubles_in_range(declared: Declared) -> tuple[float, float]:
    """Return the least and the largest double in the range of a real; a double is in range iff between them.

    Args:
        declared: a variable of a real type.

    Returns:
        Both bounds, SI; zeros if the variable has no range.
    """
    return (0.0, 0.0) if declared.range is None else declared.double_range


def check_time(now: Any) -> Reason | None:
    """Check that a time can be used.

    Args:
        now: any object.

    Returns:
        The reason why it is not a number of seconds on a clock, or None.
    """
    if _is_time(now):
        return None
    return Reason("AE704", "time", "the time of the request is not a number of seconds on a clock")


def _is_time(value: Any) -> bool:
    # NaN compares as false; beyond these bounds no clock counts seconds and a difference may overflow.
    return type(value) in (float, int) and -_EXACT_INTEGERS <= value <= _EXACT_INTEGERS


def check_freshness(checker: ValueChecker, time: Any, now: float, required: bool) -> Reason | None:
    """Check the time of a measurement.

    Args:
        checker: the measured variable.
        time: time of the measurement; should be seconds.
        now: time of the decision, s.
        required: True if a rule reads the variable; only then its age matters.

    Returns:
        The reason why the value cannot be used (malformed, in the future, too old), or None.
    """
    declared = checker.declared
    name, limit = declared.variable.name, declared.max_age
    if not _is_time(time):
        return Reason("AE704", name, f"the time of `{name}` is not a number of seconds on a clock")
    if time > now:
        return Reason("AE707", name, f"`{name}` was measured in the future")
    if not required or limit is None or now - time < checker.surely_fresh:
        return None
    age = Fraction(now) - Fraction(time)
    if age > limit:
        return Reason(
            "AE706", name, f"`{name}` is {float(age):.3g} s old; at most {float(limit):g} s is allowed"
        )
    return None


def value_checkers(declared: Mapping[str, Declared]) -> dict[str, ValueChecker]:
    """Make a checker for each declared variable.

    Args:
        declared: the variables.

    Returns:
        The checkers by the variables' names in expressions (inputs as `inputs.NAME`).
    """
    return {variable.name: ValueChecker(variable) for variable in declared.values()}


def unpack_reading(checker: ValueChecker, reading: Any, now: float, values: Scalars) -> str | None:
    """Add the scalars of a reading to `values`, if it is usable.

    Args:
        checker: the declared variable.
        reading: its reading; None if it is not measured.
        now: plant seconds.
        values: receives the scalars, SI.

    Returns:
        None if it is usable, else why it is not, to complete “`NAME` …”.
    """
    if reading is None:
        return "is not measured"
    fault = check_freshness(checker, getattr(reading, "time", None), now, True) or checker.unpack(
        getattr(reading, "value", None), values
    )
    return None if fault is None else fault.text.partition("` ")[2]

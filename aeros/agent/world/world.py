"""World model of the agent: measured values, each no older than its maximum age.

It is built from `Readings` and nothing else: expectations of a plan or claims of a skill never enter it.
A value that is missing, stale, from the future, non-finite, wrongly typed or outside its declared range is
unknown. A condition over anything unknown is itself unknown, and an unknown condition satisfies nothing.
Goals and what makes a step needless are decided by the known values alone, where these suffice.
Values become stale as time passes, also while nothing is measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import chain
from typing import Any, TypeGuard

from aeros.agent.world.values import ExactConverter, UnusableValueError, to_exact, to_json_value
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import values_by_scalar
from aeros.spec.expr.partial_truth import partial_truth
from aeros.spec.expr.semantics import Environment, Value, is_true
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType
from aeros.spec.model.cause import Cause
from aeros.spec.model.variables import Declared

NO_INPUTS: Environment = {}


@dataclass(frozen=True, slots=True)
class MeasurementStamp:
    """Origin of a measured value.

    Attributes:
        time: plant time of the measurement, s.
        source: the sensor; None if the site names none.
        max_age: seconds after which the value is unknown; None if the site declares no age.
    """

    time: float
    source: str | None
    max_age: Fraction | None


@dataclass(frozen=True, slots=True)
class WorldModel:
    """The known values at one time.

    Attributes:
        time: plant time (s).
        known: exact values by vocabulary name.
        unknown: reason why each other state variable is unknown; completes “`NAME` …”.
        predicates: measured truths, members of enums and whole numbers, for memory: JSON values, None if
            unknown.
        stamps: stamp of each known value.
        failures: causes of step failures since the previous plan; for planners, read by no condition.
        remembered: value last seen of each variable that is unknown now, as JSON, of any session; for
            planners, read by no condition.
        things: what is known of each thing that a module declares, as JSON, by its name; for planners, read
            by no condition.
        hindrances: what denied, stopped or prevented each skill in the latest steps, as JSON, by
            MODULE.SKILL; for planners, read by no condition.
    """

    time: float
    known: Mapping[str, Value]
    unknown: Mapping[str, str]
    predicates: Mapping[str, Any]
    stamps: Mapping[str, MeasurementStamp] = field(default_factory=dict)
    failures: tuple[Cause, ...] = ()
    remembered: Mapping[str, Any] = field(default_factory=dict)
    things: Mapping[str, Any] = field(default_factory=dict)
    hindrances: Mapping[str, Any] = field(default_factory=dict)

    def at_time(self, now: float) -> WorldModel:
        """Drop the values that are too old at a later time, with nothing measured since.

        Args:
            now: plant time (s).

        Returns:
            The world at `now`; it never knows more than this one.
        """
        if now == self.time:
            return self
        stale: dict[str, str] = {}
        for name, stamp in self.stamps.items():
            try:
                _check_age(stamp.time, stamp.max_age, now)
            except UnusableValueError as error:
                stale[name] = str(error)
        return WorldModel(
            now,
            {name: value for name, value in self.known.items() if name not in stale},
            {**self.unknown, **stale},
            {name: None if name in stale else value for name, value in self.predicates.items()},
            {name: stamp for name, stamp in self.stamps.items() if name not in stale},
        )

    def age(self, name: str) -> float:
        """Compute the age of a known value.

        Args:
            name: name of the variable.

        Returns:
            Seconds since it was measured.
        """
        return self.time - self.stamps[name].time

    def evaluate(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> bool | None:
        """Evaluate a condition; return None if any variable in it is unknown, whatever the others are.

        Args:
            condition: boolean term.
            inputs: exact values by `inputs.NAME`, for conditions that read a skill's inputs.

        Returns:
            The truth value, or None if it is unknown.
        """
        environment = {**self.known, **inputs}
        if any(name not in environment for name in t.variables_of(condition)):
            return None
        return is_true(condition, environment)

    def truth_by_known_values(self, condition: t.Term) -> bool | None:
        """Evaluate a goal, or what makes a step needless, as far as the known values decide it.

        Nothing is allowed because of this answer. Where `evaluate` gives a truth value, this gives the same;
        elsewhere it may give one that no value of the unknown variables could change.

        Args:
            condition: boolean term over state variables.

        Returns:
            The truth value, or None if it depends on what is unknown.
        """
        return partial_truth(condition, self.known)

    def unmet_reason(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> str:
        """Explain in words why a condition is not measured as true.

        Args:
            condition: boolean term.
            inputs: exact values by `inputs.NAME`.

        Returns:
            The unknown variables and why they are unknown; if all are known, their values.
        """
        environment = {**self.known, **inputs}
        names = t.variables_of(condition)
        missing = [name for name in names if name not in environment]
        if missing:
            return "; ".join(f"`{name}` {self.unknown.get(name, 'has no value')}" for name in missing)
        return ", ".join(f"`{name}` = {to_json_value(environment[name])}" for name in names)

    def unmet_parts(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> tuple[UnmetBound, ...]:
        """Explain as data why a condition is not measured as true.

        Args:
            condition: boolean term.
            inputs: exact values by `inputs.NAME`.

        Returns:
            Of each operand of `and` that is not true: the unknown variables; if all are known, the bounds
            that are not met. Each once.
        """
        if isinstance(condition, t.And):
            return tuple(
                dict.fromkeys(
                    chain.from_iterable(self.unmet_parts(operand, inputs) for operand in condition.operands)
                )
            )
        environment = {**self.known, **inputs}
        read = t.variables_of(condition)
        missing = tuple(
            UnmetBound(name, None, "known", True, reason=self.unknown.get(name, "has no value"))
            for name in read
            if name not in environment
        )
        return missing or unmet_bounds(condition, values_by_scalar(read, environment))

    def measured_values(self, condition: t.Term, others: Iterable[str] = ()) -> dict[str, Any]:
        """Return the values of the variables of a condition, and of others.

        Args:
            condition: boolean term.
            others: full names of further variables, which come after them.

        Returns:
            JSON values by name, None if unknown.
        """
        names = (*t.variables_of(condition), *others)
        return {name: to_json_value(self.known.get(name)) for name in names}


def world_from_readings(
    state: Mapping[str, Declared], readings: Readings, now: float, convert: ExactConverter = to_exact
) -> WorldModel:
    """Make the world from readings; readings of undeclared names are ignored.

    Args:
        state: declared state variables by name.
        readings: value (SI) and plant time (s) of state variables, by name.
        now: plant time (s).
        convert: converter to exact values, equal to `to_exact`.

    Returns:
        The world at `now`.
    """
    known: dict[str, Value] = {}
    unknown: dict[str, str] = {}
    for name, declared in state.items():
        try:
            known[name] = _value_from_reading(declared, readings.get(name), now, convert)
        except UnusableValueError as error:
            unknown[name] = str(error)
    stamps = {
        name: MeasurementStamp(readings[name].time, state[name].sensor, state[name].max_age) for name in known
    }
    predicates = {
        name: to_json_value(known.get(name)) for name, declared in state.items() if _is_predicate(declared)
    }
    return WorldModel(now, known, unknown, predicates, stamps)


def _value_from_reading(
    declared: Declared, reading: Reading | None, now: float, exactly: ExactConverter
) -> Value:
    """Convert one reading to an exact value.

    Raises:
        UnusableValueError: there is no reading, it is too old, or its value or time stamp is unusable.
    """
    if reading is None:
        raise UnusableValueError("is not measured")
    is_of_now = _is_finite_time(reading.time) and _is_finite_time(now) and reading.time == now
    if not is_of_now or declared.max_age is None:
        _check_age(reading.time, declared.max_age, now)
    return exactly(declared, reading.value)


def _check_age(time: object, max_age: Fraction | None, now: object) -> None:
    if not (_is_finite_time(time) and _is_finite_time(now)):
        raise UnusableValueError("has no usable time stamp")
    age = Fraction(now) - Fraction(time)
    if max_age is None or age > max_age:
        limit = "no age" if max_age is None else f"{float(max_age):g} s"
        raise UnusableValueError(f"was measured {float(age):g} s ago; {limit} is allowed")
    if age < 0:
        raise UnusableValueError("has a time stamp in the future")


def _is_finite_time(seconds: object) -> TypeGuard[float]:
    """Return true for a finite int or float; subclasses could define comparison, and are refused."""
    return type(seconds) is int or (type(seconds) is float and math.isfinite(seconds))


def _is_predicate(declared: Declared) -> bool:
    match declared.variable.type:
        case BoolType() | EnumType() | FamilyType(element=BoolType()) | IntegerType():
            return True
        case _:
            return False

"""What the agent holds true of the world: measured values, each no older than its maximum age.

Built from `Readings` and nothing else: what a plan expects or a skill claims never gets here.
A value that is missing, stale, from the future, non-finite, wrongly typed or outside its declared
range is unknown, and a condition over anything unknown is itself unknown, which satisfies nothing.
What is known grows stale as time goes on, also while nobody measures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, TypeGuard

from aeros.agent.world.values import ExactConverter, UnusableValueError, to_exact, to_json_value
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import values_by_scalar
from aeros.spec.expr.semantics import Environment, Value, is_true
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds
from aeros.spec.expr.types import BoolType, EnumType, FamilyType
from aeros.spec.model.cause import Cause
from aeros.spec.model.model import Declared

NO_INPUTS: Environment = {}


@dataclass(frozen=True, slots=True)
class MeasurementStamp:
    """When a value was measured, plant seconds, by which sensor, and for how many seconds it is known."""

    time: float
    source: str | None
    max_age: Fraction | None


@dataclass(frozen=True, slots=True)
class WorldModel:
    """What is known at one moment.

    time: that moment, seconds on the plant's clock.
    known: exact values by vocabulary name.
    unknown: why each other state variable is unknown; completes “`NAME` …”.
    predicates: what is measured as bool or enum, for memory: JSON values, None where unknown.
    stamps: of each known value.
    failures: why steps failed since the plan before; for planners, and read by no condition.
    """

    time: float
    known: Mapping[str, Value]
    unknown: Mapping[str, str]
    predicates: Mapping[str, Any]
    stamps: Mapping[str, MeasurementStamp] = field(default_factory=dict)
    failures: tuple[Cause, ...] = ()

    def at_time(self, now: float) -> WorldModel:
        """What is still known at `now`, with nothing measured since: never more than was."""
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
        """Seconds since a known value was measured."""
        return self.time - self.stamps[name].time

    def evaluate(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> bool | None:
        """Whether `condition` holds; None if any variable in it is unknown, whatever the others are.

        inputs: exact values by `inputs.NAME`, for conditions that mention a skill's inputs.
        """
        environment = {**self.known, **inputs}
        if any(name not in environment for name in t.variables_of(condition)):
            return None
        return is_true(condition, environment)

    def unmet_reason(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> str:
        """Why `condition` is not measured as true: what is unknown in it, else the values measured."""
        environment = {**self.known, **inputs}
        names = t.variables_of(condition)
        missing = [name for name in names if name not in environment]
        if missing:
            return "; ".join(f"`{name}` {self.unknown.get(name, 'has no value')}" for name in missing)
        return ", ".join(f"`{name}` = {to_json_value(environment[name])}" for name in names)

    def unmet_parts(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> tuple[UnmetBound, ...]:
        """The same as data: what is unknown in it, else the parts that are not as required."""
        environment = {**self.known, **inputs}
        read = t.variables_of(condition)
        missing = tuple(
            UnmetBound(name, None, "known", True, reason=self.unknown.get(name, "has no value"))
            for name in read
            if name not in environment
        )
        return missing or unmet_bounds(condition, values_by_scalar(read, environment))

    def measured_values(self, condition: t.Term) -> dict[str, Any]:
        """The values of the variables of `condition` as JSON, None where unknown."""
        return {name: to_json_value(self.known.get(name)) for name in t.variables_of(condition)}


def world_from_readings(
    state: Mapping[str, Declared], readings: Readings, now: float, convert: ExactConverter = to_exact
) -> WorldModel:
    """The world as `readings` show it at `now`; readings of undeclared names are left out.

    exactly: makes values exact as `to_exact` does.
    """
    known: dict[str, Value] = {}
    unknown: dict[str, str] = {}
    for name, declared in state.items():
        try:
            known[name] = value_from_reading(declared, readings.get(name), now, convert)
        except UnusableValueError as error:
            unknown[name] = str(error)
    stamps = {
        name: MeasurementStamp(readings[name].time, state[name].sensor, state[name].max_age) for name in known
    }
    predicates = {
        name: to_json_value(known.get(name)) for name, declared in state.items() if _is_predicate(declared)
    }
    return WorldModel(now, known, unknown, predicates, stamps)


def value_from_reading(
    declared: Declared, reading: Reading | None, now: float, exactly: ExactConverter
) -> Value:
    """What `reading` says of a state variable at `now`; raises `UnusableValueError`."""
    if reading is None:
        raise UnusableValueError("is not measured")
    is_of_now = is_finite_time(reading.time) and is_finite_time(now) and reading.time == now
    if not is_of_now or declared.max_age is None:
        _check_age(reading.time, declared.max_age, now)
    return exactly(declared, reading.value)


def _check_age(time: object, max_age: Fraction | None, now: object) -> None:
    if not (is_finite_time(time) and is_finite_time(now)):
        raise UnusableValueError("has no usable time stamp")
    age = Fraction(now) - Fraction(time)
    if max_age is None or age > max_age:
        limit = "no age" if max_age is None else f"{float(max_age):g} s"
        raise UnusableValueError(f"was measured {float(age):g} s ago; {limit} is allowed")
    if age < 0:
        raise UnusableValueError("is stamped with a time that has not come yet")


def is_finite_time(seconds: object) -> TypeGuard[float]:
    """Whether it is a number of seconds."""
    return type(seconds) is int or (type(seconds) is float and math.isfinite(seconds))


def _is_predicate(declared: Declared) -> bool:
    match declared.variable.type:
        case BoolType() | EnumType() | FamilyType(element=BoolType()):
            return True
        case _:
            return False

"""What the agent holds true of the world: measured values, each no older than its maximum age.

Built from `Readings` and nothing else: what a plan expects or a skill claims never gets here.
A value that is missing, stale, from the future, non-finite, wrongly typed or outside its declared
range is unknown, and a condition over anything unknown is itself unknown, which satisfies nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from aeros.agent.values import Exactly, UnusableValueError, exact, plain
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, Value, holds
from aeros.spec.expr.types import BoolType, EnumType, FamilyType
from aeros.spec.model import Declared

NO_INPUTS: Environment = {}


@dataclass(frozen=True, slots=True)
class World:
    """One measured moment.

    time: seconds on the plant's clock.
    known: exact values by vocabulary name.
    unknown: why each other state variable is unknown; completes “`NAME` …”.
    predicates: what is measured as bool or enum, for memory: JSON values, None where unknown.
    """

    time: float
    known: Mapping[str, Value]
    unknown: Mapping[str, str]
    predicates: Mapping[str, Any]

    def evaluate(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> bool | None:
        """Whether `condition` holds; None if any variable in it is unknown, whatever the others are.

        inputs: exact values by `inputs.NAME`, for conditions that mention a skill's inputs.
        """
        environment = {**self.known, **inputs}
        if any(name not in environment for name in t.variables_of(condition)):
            return None
        return holds(condition, environment)

    def why_not(self, condition: t.Term, inputs: Environment = NO_INPUTS) -> str:
        """Why `condition` is not measured as true: what is unknown in it, else the values measured."""
        environment = {**self.known, **inputs}
        names = t.variables_of(condition)
        missing = [name for name in names if name not in environment]
        if missing:
            return "; ".join(f"`{name}` {self.unknown.get(name, 'has no value')}" for name in missing)
        return ", ".join(f"`{name}` = {plain(environment[name])}" for name in names)

    def measured(self, condition: t.Term) -> dict[str, Any]:
        """The values of the variables of `condition` as JSON, None where unknown."""
        return {name: plain(self.known.get(name)) for name in t.variables_of(condition)}


def measured_world(
    state: Mapping[str, Declared], readings: Readings, now: float, exactly: Exactly = exact
) -> World:
    """The world as `readings` show it at `now`; readings of undeclared names are left out.

    exactly: makes values exact as `exact` does.
    """
    known: dict[str, Value] = {}
    unknown: dict[str, str] = {}
    for name, declared in state.items():
        try:
            known[name] = _measured(declared, readings.get(name), now, exactly)
        except UnusableValueError as error:
            unknown[name] = str(error)
    predicates = {name: plain(known.get(name)) for name, declared in state.items() if _is_predicate(declared)}
    return World(now, known, unknown, predicates)


def _measured(declared: Declared, reading: Reading | None, now: float, exactly: Exactly) -> Value:
    if reading is None:
        raise UnusableValueError("is not measured")
    if not (_is_time(reading.time) and _is_time(now)):
        raise UnusableValueError("has no usable time stamp")
    if reading.time == now and declared.max_age is not None:
        return exactly(declared, reading.value)
    age = Fraction(now) - Fraction(reading.time)
    if declared.max_age is None or age > declared.max_age:
        limit = "no age" if declared.max_age is None else f"{float(declared.max_age):g} s"
        raise UnusableValueError(f"was measured {float(age):g} s ago; {limit} is allowed")
    if age < 0:
        raise UnusableValueError("is stamped with a time that has not come yet")
    return exactly(declared, reading.value)


def _is_time(seconds: object) -> bool:
    return type(seconds) is int or (type(seconds) is float and math.isfinite(seconds))


def _is_predicate(declared: Declared) -> bool:
    match declared.variable.type:
        case BoolType() | EnumType() | FamilyType(element=BoolType()):
            return True
        case _:
            return False

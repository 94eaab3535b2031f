"""One predicate that an active module defines by a condition: its value is computed from readings."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from aeros.runtime.gate.conditions import CompiledCondition, ConditionValue
from aeros.runtime.gate.value_check import Scalars, ValueChecker, unpack_reading
from aeros.runtime.ports import Reading, Readings
from aeros.spec.backends.intervals import Interval, Scalar, truth_over
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.model.perception import Definition
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared


class ActiveDefinition:
    """A definition, compiled; nothing is kept between two evaluations.

    Args:
        definition: the definition.
        site: the site in force, with the variables of the modules.
    """

    def __init__(self, definition: Definition, site: Site) -> None:
        read = t.variables_of(definition.term)
        self._checkers = {name: ValueChecker(one) for name, one in site.state.items() if name in read}
        self._are_all_declared = self._checkers.keys() >= read.keys()
        self._condition = CompiledCondition(definition.term, site.state.values())
        self._over = None
        if definition.margin:
            self._over = _MarginCondition(definition, [one.declared for one in self._checkers.values()])

    def evaluate(self, readings: Readings, now: float) -> Reading | None:
        """Evaluate the condition.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.
            now: plant seconds.

        Returns:
            The value, with the time of the oldest reading in it; None if a reading is missing, too old or
            malformed, or if the readings are too uncertain for the margin of the definition.
        """
        values: Scalars = {}
        for name, checker in self._checkers.items():
            if unpack_reading(checker, readings.get(name), now, values) is not None:
                return None
        if not self._are_all_declared or not self._condition.names <= values.keys():
            return None
        if self._over is not None and not self._over.is_certain(values):
            return None
        times = [readings[name].time for name in self._checkers]
        return Reading(self._condition.decide(values) is ConditionValue.HOLDS, min([now, *times]))


class _MarginCondition:
    """Condition of a definition with a margin.

    Args:
        definition: the definition.
        read: declarations of the variables that it reads.
    """

    def __init__(self, definition: Definition, read: Iterable[Declared]) -> None:
        self._term = lower(definition.term)
        self._radius = {
            scalar.name: definition.margin * (declared.uncertainty or 0)
            for declared in read
            for scalar in scalar_variables(declared.variable)
        }

    def is_certain(self, values: Scalars) -> bool:
        """Check that the condition has one truth value, however far off the values are within the margin.

        Args:
            values: measured value of each scalar variable.

        Returns:
            True if it holds at all of them or fails at all of them.
        """
        over = {name: _spread(value, self._radius.get(name, Fraction(0))) for name, value in values.items()}
        return truth_over(self._term, over) is not None


def _spread(value: bool | str | float, radius: Fraction) -> Scalar:
    if isinstance(value, (bool, str)):
        return value
    exact = Fraction(value)
    return Interval(exact - radius, exact + radius)

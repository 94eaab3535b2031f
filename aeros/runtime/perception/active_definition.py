"""One predicate that an active module defines by a condition: its value is computed from readings."""

from __future__ import annotations

from aeros.runtime.gate.conditions import CompiledCondition, ConditionValue
from aeros.runtime.gate.value_check import Scalars, ValueChecker, unpack_reading
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.model.perception import Definition
from aeros.spec.model.site import Site


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

    def evaluate(self, readings: Readings, now: float) -> Reading | None:
        """Evaluate the condition.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.
            now: plant seconds.

        Returns:
            The value, with the time of the oldest reading in it; None if a reading is missing, too old or
            malformed.
        """
        values: Scalars = {}
        for name, checker in self._checkers.items():
            if unpack_reading(checker, readings.get(name), now, values) is not None:
                return None
        if not self._are_all_declared or not self._condition.names <= values.keys():
            return None
        times = [readings[name].time for name in self._checkers]
        return Reading(self._condition.decide(values) is ConditionValue.HOLDS, min([now, *times]))

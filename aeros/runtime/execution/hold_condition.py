"""Hold-conditions: conditions that must be measured as true while a skill runs. Unknown counts as violated.

A skill declares one; a plan has one for each part under `hold` around the step.

At a control tick a condition is decided on the values measured at every tick. If it reads other variables
too, the plant is asked for them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from aeros.runtime.gate.causes import collect_arguments
from aeros.runtime.gate.conditions import CompiledCondition, ConditionValue
from aeros.runtime.gate.value_check import Scalars, ValueChecker, unpack_reading
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.ecm import ActionCondition, Skill
from aeros.spec.model.site import Site


class HoldCondition:
    """Compiled hold-condition of one run of a skill, with the inputs of the run.

    Attributes:
        place: position in `StepRequest.held`; None if the skill declares it.
    """

    def __init__(
        self,
        site: Site,
        module: str,
        skill: Skill,
        clause: ActionCondition,
        inputs: Mapping[str, Any],
        place: int | None = None,
    ) -> None:
        self.place = place
        self._name = f"{module}.{skill.id}"
        self._clause = clause
        declared = (*site.state.values(), *skill.inputs.values())
        self._condition = CompiledCondition(clause.term, declared)
        read = t.variables_of(clause.term)
        self._forms = {name: ValueChecker(one) for name, one in site.state.items() if name in read}
        self._inputs: Scalars = {}
        forms = {one.name: ValueChecker(one) for one in skill.inputs.values()}
        # Undeclared inputs were refused before the step began; here they are unknown.
        collect_arguments(forms, {f"inputs.{name}": value for name, value in inputs.items()}, self._inputs)

    def violation(self, readings: Readings, now: float) -> Cause | None:
        """Check the condition on readings.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.
            now: plant seconds.

        Returns:
            The cause if the condition is false or unknown; None if it holds.
        """
        return self._decide(lambda name: readings.get(name), now)

    def violation_at_tick(
        self, measured: Mapping[str, Any], now: float, observe: Callable[[], Readings]
    ) -> Cause | None:
        """Check the condition at a control tick.

        Args:
            measured: values (SI) or readings measured at this tick, by name.
            now: plant seconds.
            observe: returns all readings; called only if the condition reads a variable not in `measured`.

        Returns:
            The cause if the condition is false or unknown; None if it holds.
        """
        slow = {} if self._forms.keys() <= measured.keys() else observe()

        def read(name: str) -> Any:
            if name not in measured:
                return slow.get(name)
            value = measured[name]
            return value if type(value) is Reading else Reading(value, now)

        return self._decide(read, now)

    def _decide(self, read: Callable[[str], Any], now: float) -> Cause | None:
        values = dict(self._inputs)
        unknown = []
        for name, form in self._forms.items():
            why = unpack_reading(form, read(name), now, values)
            if why is not None:
                unknown.append(UnmetBound(name, None, "known", True, reason=why))
        if unknown:
            return self._cause(tuple(unknown))
        if self._condition.names <= values.keys() and self._condition.decide(values) is ConditionValue.HOLDS:
            return None
        return self._cause(unmet_bounds(self._clause.term, values))

    def _cause(self, parts: tuple[UnmetBound, ...]) -> Cause:
        return Cause(
            "hold", self._name, self._clause.text, location=file_and_line(self._clause.span), shortfalls=parts
        )


def hold_conditions_for(
    site: Site, module: str, skill: Skill, inputs: Mapping[str, Any], held: Sequence[ActionCondition] = ()
) -> tuple[HoldCondition, ...]:
    """Compile the hold-conditions of a run of `skill`.

    Args:
        site: declares the state variables.
        module: id of the skill's module.
        skill: the skill.
        inputs: checked inputs of the run, SI, by name.
        held: conditions of the parts of a plan around the step, the outermost first.

    Returns:
        The conditions of these parts, and then the skill's own if it declares one.
    """
    clauses: list[tuple[int | None, ActionCondition]] = [*enumerate(held)]
    if skill.hold_condition is not None:
        clauses.append((None, skill.hold_condition))
    return tuple(HoldCondition(site, module, skill, clause, inputs, place) for place, clause in clauses)

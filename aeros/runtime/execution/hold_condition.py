"""What must be measured as long as a skill runs, watched as rules are: unknown is not measured.

It is decided on the values of the moment: at a control tick on what is measured at every tick, and on all
that is measured then where the condition reads anything else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from aeros.runtime.gate.conditions import CompiledCondition, ConditionValue
from aeros.runtime.gate.request_check import unpack_arguments
from aeros.runtime.gate.value_check import Scalars, ValueChecker, check_freshness
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.model import ActionCondition, Site, Skill


class HoldCondition:
    """The hold-condition of one run of a skill, with the run's inputs."""

    def __init__(
        self, site: Site, module: str, skill: Skill, clause: ActionCondition, inputs: Mapping[str, Any]
    ) -> None:
        self._name = f"{module}.{skill.id}"
        self._clause = clause
        declared = (*site.state.values(), *skill.inputs.values())
        self._condition = CompiledCondition(clause.term, declared)
        read = t.variables_of(clause.term)
        self._forms = {name: ValueChecker(one) for name, one in site.state.items() if name in read}
        self._inputs: Scalars = {}
        forms = {one.name: ValueChecker(one) for one in skill.inputs.values()}
        for _ in unpack_arguments(
            forms, {f"inputs.{name}": value for name, value in inputs.items()}, "", self._inputs
        ):
            pass  # what is no input of the skill was refused before it began; here it is unknown

    def violation(self, readings: Readings, now: float) -> Cause | None:
        """Why it is not measured as true, or None."""
        return self._decide(lambda name: readings.get(name), now)

    def violation_at_tick(
        self, measured: Mapping[str, Any], now: float, observe: Callable[[], Readings]
    ) -> Cause | None:
        """Likewise of what a monitor is given; `observe` is asked for the rest, if there is any."""
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
            why = _unpack_reading(form, read(name), now, values)
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


def hold_condition_for(
    site: Site, module: str, skill: Skill, inputs: Mapping[str, Any]
) -> HoldCondition | None:
    """The hold-condition of a run of `skill`, if it declares one."""
    return (
        None
        if skill.hold_condition is None
        else HoldCondition(site, module, skill, skill.hold_condition, inputs)
    )


def _unpack_reading(checker: ValueChecker, reading: Any, now: float, values: Scalars) -> str | None:
    """Take the scalars of a reading, or say why it serves for nothing; completes “`NAME` …”."""
    if reading is None:
        return "is not measured"
    fault = check_freshness(checker, getattr(reading, "time", None), now, True) or checker.unpack(
        getattr(reading, "value", None), values
    )
    return None if fault is None else fault.text.partition("` ")[2]

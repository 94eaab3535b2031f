"""Φ while a motion runs: the rules that let it start are decided again at every control tick.

The action's parameters are those that were decided; the state is what is measured now.  A state
variable that the plant does not measure every tick keeps the value it had when the action was
decided.  A value that is missing, malformed, not finite or out of range stops the motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.runtime.conditions import CompiledCondition
from aeros.runtime.form import Scalars, forms_of
from aeros.runtime.ports import Monitor, Readings
from aeros.skill import Action
from aeros.spec.model import Site


class MonitorFactory:
    """Makes the monitor of each motion under one site."""

    def __init__(self, site: Site) -> None:
        self._state = forms_of(site.state)
        self._parameters = {name: forms_of(kind.parameters) for name, kind in site.kinds.items()}
        self._rules = {
            name: tuple(
                (
                    rule.id,
                    CompiledCondition(
                        rule.terms[name], (*site.state.values(), *kind.parameters.values())
                    ).holds,
                )
                for rule in site.rules_on(name)
            )
            for name, kind in site.kinds.items()
        }

    def watch(self, action: Action, readings: Readings) -> Monitor:
        """The monitor of `action`, which was decided on `readings`."""
        decided: Scalars = {}
        for name, form in self._parameters[action.kind].items():
            form.take(action.parameters[name], decided)
        for name, reading in readings.items():
            self._state[name].take(reading.value, decided)
        rules = self._rules[action.kind]

        def monitor(measured: Mapping[str, Any]) -> str | None:
            values = dict(decided)
            for name, value in measured.items():
                form = self._state.get(name)
                if form is None or form.take(value, values) is not None:
                    return f"input:{name}"
            try:
                for rule, holds in rules:
                    if not holds(values):
                        return rule
            except KeyError as missing:
                return f"input:{missing.args[0]}"
            return None

        return monitor

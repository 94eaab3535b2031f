"""Φ while a motion runs: the rules that let it start are decided again at every control tick.

The action's parameters are those that were decided; the state is what is measured now.  A state
variable that the plant does not measure every tick keeps the value it had when the action was
decided.  One that was measured at one tick must be measured at the next.  A value that is missing,
malformed, not finite or out of range stops the motion.  So does a history that is not known: it goes
on from tick to tick, over values that are then measured or not yet too old.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Any

from aeros.runtime.conditions import CompiledCondition, Condition, Truth
from aeros.runtime.form import Form, Scalars, forms_of
from aeros.runtime.history import Histories
from aeros.runtime.ports import Monitor, Reading, Readings
from aeros.skill import Action
from aeros.spec.model import Site

_Rules = tuple[tuple[str, Condition], ...]


class MonitorFactory:
    """Makes the monitor of each motion under one site."""

    def __init__(self, site: Site, histories: Histories) -> None:
        self._histories = histories
        self._state = forms_of(site.observed)
        self._parameters = {name: forms_of(kind.parameters) for name, kind in site.kinds.items()}
        self._rules: dict[str, _Rules] = {
            name: tuple(
                (
                    rule.id,
                    CompiledCondition(rule.terms[name], (*site.observed.values(), *kind.parameters.values())),
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
        measured = {name: one for name, one in readings.items() if name not in self._histories.names}
        return _Watch(self._state, self._rules[action.kind], decided, measured, self._histories)


class _Watch:
    """The monitor of one action; keeps the latest values, and which of them were measured last."""

    def __init__(
        self,
        state: Mapping[str, Form],
        rules: _Rules,
        values: Scalars,
        readings: dict[str, Reading],
        histories: Histories,
    ) -> None:
        self._state = state
        self._rules = rules
        self._values = values
        self._readings = readings
        self._histories = histories
        self._measured: Set[str] = frozenset()

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        gone = self._measured - measured.keys()
        if gone:
            return f"input:{min(gone)}"
        self._measured = set(measured)
        for name, value in measured.items():
            form = self._state.get(name)
            if form is None or form.take(value, self._values) is not None:
                return f"input:{name}"
        if self._histories.names:
            self._look_back(now, measured)
        for rule, condition in self._rules:
            if not condition.names <= self._values.keys():
                return f"input:{min(condition.names - self._values.keys())}"
            if condition.decide(self._values) is not Truth.HOLDS:
                return rule
        return None

    def _look_back(self, now: float, measured: Mapping[str, Any]) -> None:
        self._readings.update((name, Reading(value, now)) for name, value in measured.items())
        known = self._histories.advance(self._readings, now)
        for name in self._histories.names:
            if name not in known or self._state[name].take(known[name].value, self._values) is not None:
                self._values.pop(name, None)

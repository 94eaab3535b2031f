"""Φ while motions run: the rules that let them start are decided again at every control tick.

An action's parameters are those that were decided; the state is what is measured now.  A state
variable that the plant does not measure every tick keeps the value it had when the action was
decided.  One that was measured at one tick must be measured at the next, and a `Reading` of it must not
be older than its `max_age`.  A value that is missing, malformed, not finite or out of range stops the
motion.  So does a history that is not known: it goes
on from tick to tick, over values that are then measured or not yet too old.

Of every two actions under way the joint rules are decided likewise (`beside`).
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Any

from aeros.runtime.beside import Begun, JointRules
from aeros.runtime.conditions import CompiledCondition, Condition, Truth
from aeros.runtime.form import Form, Scalars, forms_of
from aeros.runtime.history import Histories, Known
from aeros.runtime.intake import take_reading
from aeros.runtime.ports import Reading, Readings
from aeros.runtime.violation import Violation
from aeros.spec.expr.terms import Term
from aeros.spec.model import Site

_Rules = tuple[tuple[str, Condition, Term], ...]


class Monitors:
    """The monitor of everything under way under one site: a `ports.Monitor`."""

    def __init__(self, site: Site, histories: Histories) -> None:
        self._histories = histories
        self._state = forms_of(site.observed)
        self._parameters = {name: forms_of(kind.parameters) for name, kind in site.kinds.items()}
        self._rules: dict[str, _Rules] = {
            name: tuple(
                (
                    rule.id,
                    CompiledCondition(rule.terms[name], (*site.observed.values(), *kind.parameters.values())),
                    rule.terms[name],
                )
                for rule in site.rules_on(name)
            )
            for name, kind in site.kinds.items()
        }
        self._joint = JointRules(site, compiled=True)
        self._watched: list[Begun] = []
        self._watches: list[tuple[tuple[Begun, ...], _Watch]] = []
        self._readings: dict[str, Reading] = {}
        self.violation: Violation | None = None
        """The last rule that did not hold, and at which values."""

    def watch(self, begun: Begun) -> None:
        """From now on watch this action too, which has just been decided."""
        asked: Scalars = {}
        for name, form in self._parameters[begun.action.kind].items():
            form.take(begun.action.parameters[name], asked)
        self._add((begun,), self._rules[begun.action.kind], asked, begun.readings)
        for other in self._watched:
            for rule, roles in self._joint.of(begun, other):
                asked = rule.values(roles)
                self._add((begun, other), ((rule.id, rule.condition, rule.term),), asked, begun.readings)
        if not self._watched:
            self._readings = {}
        self._readings.update(
            {name: one for name, one in begun.readings.items() if name not in self._histories.names}
        )
        self._watched.append(begun)

    def forget(self, begun: Begun) -> None:
        """It is not under way any more."""
        self._watched.remove(begun)
        self._watches = [(whose, watch) for whose, watch in self._watches if begun not in whose]

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """The id of the first rule that does not hold, or `input:NAME`; else None."""
        known = self._look_back(now, measured)
        for _, watch in self._watches:
            broken = watch.broken(now, measured, known)
            if broken is not None:
                self.violation = broken if isinstance(broken, Violation) else None
                return broken.rule if isinstance(broken, Violation) else broken
        return None

    def _add(self, whose: tuple[Begun, ...], rules: _Rules, values: Scalars, readings: Readings) -> None:
        for name, reading in readings.items():
            self._state[name].take(reading.value, values)
        self._watches.append((whose, _Watch(self._state, rules, values, self._histories.names)))

    def _look_back(self, now: float, measured: Mapping[str, Any]) -> Known:
        """The histories that are known at this tick, which is one moment, however many are watched."""
        if not self._histories.names:
            return {}
        self._readings.update(
            (name, value if type(value) is Reading else Reading(value, now))
            for name, value in measured.items()
        )
        return self._histories.advance(self._readings, now)


class _Watch:
    """Rules on one action or on two; keeps the latest values, and which of them were measured last."""

    def __init__(
        self, state: Mapping[str, Form], rules: _Rules, values: Scalars, histories: Set[str]
    ) -> None:
        self._state = state
        self._rules = rules
        self._values = values
        self._histories = histories
        self._measured: Set[str] = frozenset()

    def broken(self, now: float, measured: Mapping[str, Any], known: Known) -> Violation | str | None:
        """What does not hold where these values are measured and these histories known."""
        gone = self._measured - measured.keys()
        if gone:
            return f"input:{min(gone)}"
        self._measured = set(measured)
        for name, value in measured.items():
            form = self._state.get(name)
            if form is None:
                return f"input:{name}"
            if type(value) is Reading:
                fault = take_reading(form, value, now, True, self._values)
            else:
                fault = form.take(value, self._values)
            if fault is not None:
                return f"input:{name}"
        for name in self._histories:
            if name not in known or self._state[name].take(known[name], self._values) is not None:
                self._values.pop(name, None)
        for rule, condition, term in self._rules:
            if not condition.names <= self._values.keys():
                return f"input:{min(condition.names - self._values.keys())}"
            if condition.decide(self._values) is not Truth.HOLDS:
                return Violation(rule, term, {name: self._values[name] for name in condition.names})
        return None

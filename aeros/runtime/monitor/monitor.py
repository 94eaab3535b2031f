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

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from aeros.runtime.gate.compiled.rules import CompiledRuleSet, FastTickCheck, MonitorRules
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.value_check import Scalars, check_freshness
from aeros.runtime.gate.violation import RuleViolation
from aeros.runtime.monitor.history import HistoryTracker, HistoryValues
from aeros.runtime.ports import Reading

_NEVER_CACHED: Final = object()
"""In place of a list, which may hold other values the next time that it is looked at."""

_MAX_NAME_SETS: Final = 8
"""As many sets of names are measured at ticks as there are kinds of motion, at most."""


class _CheckedValue(NamedTuple):
    """A value that has the form of its variable, and its scalars."""

    value: Any
    scalars: Scalars


class _MonitoredActions:
    """What is watched of one action, or of two together.

    asked: scalars of their parameters.
    """

    __slots__ = ("asked", "rules", "values", "whose")

    def __init__(
        self, actions: tuple[ActiveAction, ...], rules: CompiledRuleSet, requested_values: Scalars
    ) -> None:
        self.whose = actions
        self.rules = rules
        self.asked = requested_values
        self.values: Scalars | None = None
        """What is asked, and the state that the first was decided on, as far as it is not measured since."""


class RuntimeMonitor:
    """The monitor of everything under way under one site: a `ports.Monitor`."""

    def __init__(self, watched: MonitorRules, histories: HistoryTracker) -> None:
        self._compiled = watched
        self._histories = histories
        # Of each variable the last value that had its form; it is not looked at again while it is measured.
        self._formed: dict[str, _CheckedValue] = {}
        self._measured: frozenset[str] = frozenset()
        self._watched: list[ActiveAction] = []
        self._met: set[frozenset[str]] = set()  # names of what was measured when something new was watched
        self._quicks: dict[
            tuple[str, frozenset[str]], FastTickCheck | None
        ] = {}  # by action kind, for these names
        self._holds: Callable[[Mapping[str, Any]], bool] | None = None
        self._is_new = False  # something is watched since the last tick that was not, or the reverse
        self._watches: list[_MonitoredActions] = []
        self._readings: dict[str, Reading] = {}
        self.violation: RuleViolation | None = None
        """The last rule that did not hold, and at which values."""

    def add(self, active_action: ActiveAction) -> None:
        """From now on watch this action too, which has just been decided.

        What decides its ticks quickly is compiled here, for whatever was measured at ticks before: it takes
        longer than a tick.
        """
        kind = active_action.action.kind
        for names in self._met:
            if (kind, names) not in self._quicks:
                self._quicks[kind, names] = self._compiled.fast_check(kind, names)
        asked: Scalars = {}
        for name, taking in self._compiled.parameters[kind].items():
            asked.update(taking(active_action.action.parameters[name]) or {})
        self._watches.append(_MonitoredActions((active_action,), self._compiled.rules_for_kind(kind), asked))
        for other in self._watched:
            for rules, parameters in self._compiled.rules_for_pair(active_action, other):
                self._watches.append(_MonitoredActions((active_action, other), rules, parameters))
        if self._histories.names:
            if not self._watched:
                self._readings = {}
            self._readings.update(
                {
                    name: one
                    for name, one in active_action.readings.items()
                    if name not in self._histories.names
                }
            )
        self._watched.append(active_action)
        self._is_new = True

    def remove(self, active_action: ActiveAction) -> None:
        """It is not under way any more."""
        self._watched.remove(active_action)
        self._watches = [one for one in self._watches if active_action not in one.whose]
        self._is_new = True
        if not self._watched:
            self._measured = frozenset()

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """The id of the first rule that does not hold, or `input:NAME`; else None."""
        if self._is_new:
            quick, self._is_new = self._fast_check_for(measured), False
            self._holds = None if quick is None else quick.holds
        if self._holds is not None and self._holds(measured):
            return None
        known = self._update_histories(now, measured)
        if not self._watches:
            return None
        fault = self._measurement_fault(now, measured)
        if fault is not None:
            return fault
        for watch in self._watches:
            rules, values = watch.rules, self._values(watch)
            for name in rules.reads:
                if name in self._histories.names:
                    self._unpack_history(name, known, values)
                elif name in measured:
                    values.update(self._formed[name].scalars)
            broken = rules.first_violation(values)
            if broken is not None:
                self.violation = broken if isinstance(broken, RuleViolation) else None
                return broken.rule if isinstance(broken, RuleViolation) else broken
        return None

    def _fast_check_for(self, measured: Mapping[str, Any]) -> FastTickCheck | None:
        """Decides ticks at which as much is measured as now, where one action is under way and no other.

        None, too, where as much was never measured before this action was watched.
        """
        names = frozenset(measured)
        if names not in self._met:
            if len(self._met) == _MAX_NAME_SETS:
                self._met.clear()
                self._quicks.clear()
            self._met.add(names)
        if len(self._watches) != 1 or not self._measured <= names:
            return None
        (watch,) = self._watches
        quick = self._quicks.get((watch.whose[0].action.kind, names))
        if quick is None:
            return None
        try:
            quick.decide(watch.asked if names.issuperset(watch.rules.reads) else self._values(watch))
        except KeyError:
            return None  # something that rules read is neither there nor measured
        self._measured = names
        return quick

    def _values(self, watch: _MonitoredActions) -> Scalars:
        """What is watched with, at first with the state that the first of the actions was decided on."""
        if watch.values is None:
            watch.values = dict(watch.asked)
            for name in watch.rules.reads:
                reading = watch.whose[0].readings.get(name)
                if reading is not None:
                    # Not kept as the last value of its form: what is measured by now is that.
                    watch.values.update(self._unpack(name, reading.value) or {})
        return watch.values

    def _measurement_fault(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """`input:NAME` of what is measured no more, or not as it should be; takes the scalars of the rest."""
        if len(measured) != len(self._measured) or not self._measured <= measured.keys():
            gone = self._measured - measured.keys()
            if gone:
                return f"input:{min(gone)}"
            self._measured = frozenset(measured)
        for name, value in measured.items():
            formed = self._formed.get(name)
            if formed is not None and formed.value is value:
                continue
            form = self._compiled.forms.get(name)
            if form is None:
                return f"input:{name}"
            if type(value) is Reading:
                if (
                    len(value) != len(Reading._fields)
                    or check_freshness(form, value.time, now, True) is not None
                ):
                    return f"input:{name}"
                value = value.value
            if self._scalars(name, value) is None:
                return f"input:{name}"
        return None

    def _scalars(self, name: str, value: Any) -> Scalars | None:
        """Those of a state variable's value, or None where that has not its form; kept from now on."""
        scalars = self._unpack(name, value)
        if scalars is not None:
            self._formed[name] = _CheckedValue(_NEVER_CACHED if type(value) is list else value, scalars)
        return scalars

    def _unpack(self, name: str, value: Any) -> Scalars | None:
        """The same, and nothing is kept."""
        formed = self._formed.get(name)
        if formed is not None and formed.value is value:
            return formed.scalars
        return self._compiled.taking[name](value)

    def _unpack_history(self, name: str, known: HistoryValues, values: Scalars) -> None:
        scalars = self._scalars(name, known[name]) if name in known else None
        if scalars is None:
            values.pop(name, None)
        else:
            values.update(scalars)

    def _update_histories(self, now: float, measured: Mapping[str, Any]) -> HistoryValues:
        """The histories that are known at this tick, which is one moment, however many are watched."""
        if not self._histories.names:
            return {}
        self._readings.update(
            (name, value if type(value) is Reading else Reading(value, now))
            for name, value in measured.items()
        )
        return self._histories.advance(self._readings, now)

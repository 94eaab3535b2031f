"""Runtime monitor: checks the rules of Φ that allowed an action at every control tick, 240 times a second.

The parameters are those of the decision; the state is what is measured now. A state variable that the plant
does not measure at a tick keeps the value that the action was decided on. A variable that was measured at one
tick must be measured at the next, and a `Reading` of it must not be older than its `max_age`. A value that is
missing, malformed, not finite or out of range stops the motion. So does an unknown history; histories are
updated at every tick, with the values measured then or still valid.

The joint rules are evaluated likewise for every two actions under way.

Once it has named a rule, the monitor goes on until the robot is at rest. It records each tick of the stop
(`stop_record`), and decides whether the robot may back off from what it touches: it answers `BACK_OFF` if all
rules on the site's kind `motion.back_off` hold, else with the first that does not. If the site has no such
kind, the answer is the rule that stopped the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from aeros.runtime.gate.compiled.rules import CompiledRuleSet, FastTickCheck, MonitorRules
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.value_check import Scalars, ValueChecker, check_freshness, is_reading
from aeros.runtime.gate.violation import MotionDeviation, RuleViolation
from aeros.runtime.monitor.history import HistoryTracker, HistoryValues
from aeros.runtime.monitor.stop_record import StopRecords, stop_quantities
from aeros.runtime.monitor.tracking import MotionTracker
from aeros.runtime.ports import BACK_OFF, Reading

_NEVER_CACHED: Final = object()
"""Placeholder for a list, whose contents may change between ticks."""

_MAX_NAME_SETS: Final = 8
"""Number of different sets of variables measured at ticks: at most one for each kind of motion."""


class _CheckedValue(NamedTuple):
    """A well-formed value of a variable, with its scalars."""

    value: Any
    scalars: Scalars


class _MonitoredActions:
    """One action, or two together, with the rules that are watched of them.

    actions: those whose rules they are.
    rules: the rules to evaluate.
    requested_values: scalars of the actions' parameters.
    values: the parameters' scalars and the state that the first action was decided on, where nothing newer is
        measured; None before they are needed.
    """

    __slots__ = ("actions", "requested_values", "rules", "values")

    def __init__(
        self, actions: tuple[ActiveAction, ...], rules: CompiledRuleSet, requested_values: Scalars
    ) -> None:
        self.actions = actions
        self.rules = rules
        self.requested_values = requested_values
        self.values: Scalars | None = None
        """Scalars of the requests, and of the state at the first decision, where not measured since."""


_Watches = Sequence[_MonitoredActions]


def _is_unread(name: str, watches: _Watches) -> bool:
    """Tell if a name is of a module's variable that no rule under watch reads: its value stops nothing."""
    return "." in name and all(name not in watch.rules.reads for watch in watches)


class RuntimeMonitor:
    """The monitor of all actions under way under one site; a `ports.Monitor`.

    Attributes:
        rules: the compiled rules of the site.
        histories: the site's histories, updated at every tick.
        stops: records of the stops under way.
        tracker: compares the robot with the motions that were decided.
        violation: the last rule that did not hold, with its values.
    """

    def __init__(self, rules: MonitorRules, histories: HistoryTracker) -> None:
        self._compiled = rules
        self.stops = StopRecords(stop_quantities(rules.site))
        self._back_off: _MonitoredActions | None = None
        self.tracker = MotionTracker(rules.site.motion)
        self._histories = histories
        # The last well-formed value of each variable; the same object is not checked again.
        self._checked_values: dict[str, _CheckedValue] = {}
        self._measured: frozenset[str] = frozenset()
        self._active_actions: list[ActiveAction] = []
        self._measured_name_sets: set[frozenset[str]] = set()  # sets of variables measured at earlier ticks
        self._fast_checks: dict[
            tuple[str, frozenset[str]], FastTickCheck | None
        ] = {}  # by action kind and set of measured variables
        self._holds: Callable[[Mapping[str, Any]], bool] | None = None
        self._has_changed = False  # an action was added or removed, or other variables were measured
        self._watches: list[_MonitoredActions] = []
        self._readings: dict[str, Reading] = {}
        self.violation: RuleViolation | MotionDeviation | None = None
        """The last rule that did not hold, with its values."""

    def add(self, active_action: ActiveAction, plan: object = None) -> None:
        """Start to watch an action that the gate has just allowed.

        The fast check of its ticks is compiled here, for each set of variables that earlier ticks measured,
        because compiling takes longer than a tick.

        Args:
            active_action: the action, as it was decided.
            plan: its motion, if that was decided; the measured robot is compared with it.
        """
        self.tracker.add(active_action.record_number, plan)
        kind = active_action.action.kind
        for names in self._measured_name_sets:
            if (kind, names) not in self._fast_checks:
                self._fast_checks[kind, names] = self._compiled.fast_check(kind, names)
        requested_values: Scalars = {}
        for name, unpack in self._compiled.parameters[kind].items():
            requested_values.update(unpack(active_action.action.parameters[name]) or {})
        self._watches.append(
            _MonitoredActions((active_action,), self._compiled.by_kind[kind], requested_values)
        )
        for other in self._active_actions:
            for rules, parameters in self._compiled.rules_for_pair(active_action, other):
                self._watches.append(_MonitoredActions((active_action, other), rules, parameters))
        if self._histories.names:
            if not self._active_actions:
                self._readings = {}
            self._readings.update(
                {
                    name: reading
                    for name, reading in active_action.readings.items()
                    if name not in self._histories.names
                }
            )
        self._active_actions.append(active_action)
        self._has_changed = True

    def remove(self, active_action: ActiveAction) -> None:
        """Stop watching an action that is no longer under way.

        Args:
            active_action: the action given to `add`.
        """
        self._active_actions.remove(active_action)
        self.tracker.remove(active_action.record_number)
        self._watches = [watch for watch in self._watches if active_action not in watch.actions]
        self._has_changed = True
        if not self._active_actions:
            self._measured = frozenset()
            if self.stops.are_open:
                self.stops.clear()

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """Check a control tick: return the first rule that does not hold, or `input:NAME`; else None."""
        if self._has_changed:
            fast_check, self._has_changed = self._fast_check_for(measured), False
            self._holds = None if fast_check is None else fast_check.holds
        stops, tracker = self.stops, self.tracker
        is_off = None if tracker.is_idle or stops.stop is not None else tracker.violation(now, measured)
        if is_off is None and not stops.are_open and self._holds is not None:
            values = _values_of_readings(self._compiled.forms, now, measured)
            if values is not None and self._holds(values):
                return None
        if stops.are_open:
            stops.add(measured)
        known = self._update_histories(now, measured)
        if stops.stop is not None:
            return self._back_off_violation(stops.stop.reason, now, measured, known)
        rule = self._first_violation(now, measured, known)
        if rule is None and is_off is not None:
            rule, self.violation = is_off, tracker.deviation
        if rule is not None:
            self.begin_stop(rule, now)
            stops.add(measured)
        return rule

    def begin_stop(self, reason: str, now: float) -> None:
        """Record a stop of the whole robot from now on, and decide whether it may back off.

        Args:
            reason: id of the rule that stops it, or words.
            now: plant time, s.
        """
        self.stops.begin_stop(reason, now)
        kind = self._compiled.back_off
        rules = None if kind is None or not self._active_actions else self._compiled.by_kind[kind]
        self._back_off = None if rules is None else _MonitoredActions((self._active_actions[0],), rules, {})

    def _back_off_violation(
        self, reason: str, now: float, measured: Mapping[str, Any], known: HistoryValues
    ) -> str | None:
        """Return the first rule that forbids to back off after a stop for `reason`, or `BACK_OFF`."""
        if self._back_off is None:
            return reason
        fault = self._measurement_fault(now, measured, (*self._watches, self._back_off))
        if fault is not None:
            return fault
        violation = self._violation(self._back_off, measured, known)
        return BACK_OFF if violation is None else _rule_of(violation)

    def _first_violation(self, now: float, measured: Mapping[str, Any], known: HistoryValues) -> str | None:
        if not self._watches:
            return None
        fault = self._measurement_fault(now, measured, self._watches)
        if fault is not None:
            return fault
        for watch in self._watches:
            violation = self._violation(watch, measured, known)
            if violation is not None:
                self.violation = violation if isinstance(violation, RuleViolation) else None
                return _rule_of(violation)
        return None

    def _violation(
        self, watch: _MonitoredActions, measured: Mapping[str, Any], known: HistoryValues
    ) -> RuleViolation | str | None:
        """Evaluate the rules of a watch with what is measured at this tick."""
        rules, values = watch.rules, self._values(watch)
        for name in rules.reads:
            if name in self._histories.names:
                self._unpack_history(name, known, values)
            elif name in measured:
                values.update(self._checked_values[name].scalars)
        return rules.first_violation(values)

    def _fast_check_for(self, measured: Mapping[str, Any]) -> FastTickCheck | None:
        """Return the fast check for ticks with these measurements, if exactly one action is under way.

        None, too, if no tick measured this set of variables before the action was added.
        """
        names = frozenset(measured)
        if names not in self._measured_name_sets:
            if len(self._measured_name_sets) == _MAX_NAME_SETS:
                self._measured_name_sets.clear()
                self._fast_checks.clear()
            self._measured_name_sets.add(names)
        if len(self._watches) != 1 or not self._measured <= names:
            return None
        (watch,) = self._watches
        fast_check = self._fast_checks.get((watch.actions[0].action.kind, names))
        if fast_check is None:
            return None
        try:
            fast_check.decide(
                watch.requested_values if names.issuperset(watch.rules.reads) else self._values(watch)
            )
        except KeyError:
            return None  # a variable that rules read is neither measured nor in the readings of the decision
        self._measured = names
        return fast_check

    def _values(self, watch: _MonitoredActions) -> Scalars:
        """Return the scalars to evaluate with; initially the state that the first action was decided on."""
        if watch.values is None:
            watch.values = dict(watch.requested_values)
            for name in watch.rules.reads:
                reading = watch.actions[0].readings.get(name)
                if reading is not None:
                    # Not remembered in `_checked_values`, which holds what is measured now.
                    watch.values.update(self._unpack(name, reading.value) or {})
        return watch.values

    def _measurement_fault(self, now: float, measured: Mapping[str, Any], watches: _Watches) -> str | None:
        """Return `input:NAME` of a value that is missing or malformed; store the scalars of the others."""
        if len(measured) != len(self._measured) or not self._measured <= measured.keys():
            missing = [one for one in self._measured - measured.keys() if not _is_unread(one, watches)]
            if missing:
                return f"input:{min(missing)}"
            self._measured = frozenset(name for name in measured if not _is_unread(name, watches))
            self._has_changed = True  # a fast check of fewer variables would not miss the others
        for name, value in measured.items():
            checked = self._checked_values.get(name)
            if checked is not None and checked.value is value:
                continue
            if not self._is_usable(name, value, now) and not _is_unread(name, watches):
                return f"input:{name}"
        return None

    def _is_usable(self, name: str, value: Any, now: float) -> bool:
        """Check a measured value or reading, and store its scalars."""
        if type(value) is Reading:
            if not _is_fresh(self._compiled.forms.get(name), value, now):
                return False
            value = value.value
        return name in self._compiled.forms and self._scalars(name, value) is not None

    def _scalars(self, name: str, value: Any) -> Scalars | None:
        """Unpack and remember a state variable's value; return None if it is malformed."""
        scalars = self._unpack(name, value)
        if scalars is not None:
            self._checked_values[name] = _CheckedValue(
                _NEVER_CACHED if type(value) is list else value, scalars
            )
        return scalars

    def _unpack(self, name: str, value: Any) -> Scalars | None:
        """Unpack a state variable's value without remembering it; return None if it is malformed."""
        checked = self._checked_values.get(name)
        if checked is not None and checked.value is value:
            return checked.scalars
        return self._compiled.unpackers[name](value)

    def _unpack_history(self, name: str, known: HistoryValues, values: Scalars) -> None:
        scalars = self._scalars(name, known[name]) if name in known else None
        if scalars is None:
            values.pop(name, None)
        else:
            values.update(scalars)

    def _update_histories(self, now: float, measured: Mapping[str, Any]) -> HistoryValues:
        """Update the histories once for this tick, and return those that are known."""
        if not self._histories.names:
            return {}
        self._readings.update(
            (name, value if type(value) is Reading else Reading(value, now))
            for name, value in measured.items()
        )
        return self._histories.advance(self._readings, now)


def _is_fresh(checker: ValueChecker | None, given: Reading, now: float) -> bool:
    """Check that a reading is whole, of a declared variable, not of the future, and not too old."""
    return (
        checker is not None and is_reading(given) and check_freshness(checker, given.time, now, True) is None
    )


def _values_of_readings(
    forms: Mapping[str, ValueChecker], now: float, measured: Mapping[str, Any]
) -> Mapping[str, Any] | None:
    """Return what is measured, with values in place of readings; None if a reading cannot be used."""
    found: dict[str, Any] | None = None
    for name, given in measured.items():
        if type(given) is Reading:
            if not _is_fresh(forms.get(name), given, now):
                return None
            if found is None:
                found = dict(measured)
            found[name] = given.value
    return measured if found is None else found


def _rule_of(violation: RuleViolation | str) -> str:
    """Return the name under which a violation stops the robot."""
    return violation.rule if isinstance(violation, RuleViolation) else violation

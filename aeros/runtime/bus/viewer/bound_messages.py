"""Messages of quantities that rules of the site bound, each with its tightest bounds now.

Bounds are those of the rules about the actions under way (`runtime.monitor.bounds_in_force`).
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from fractions import Fraction
from math import inf, isfinite, isinf, nan
from typing import Final, NamedTuple

from aeros.runtime.bus.messages import BoundedQuantity, Header, Time, stamp
from aeros.runtime.monitor.bounds_in_force import BoundInForce, BoundsInForce, scalars
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import RealType
from aeros.spec.model.site import Site

PREFIX: Final = "/aeros/bounds"

PERIOD: Final = 0.1
"""Least time between the messages of a quantity, plant seconds: computing all bounds takes a millisecond."""

_ENDS: Final = ("step-ended", "step-broken")


class BoundableQuantity(NamedTuple):
    """Scalar variable that some rule can bound.

    Attributes:
        name: its name; of a parameter, after the kind of action.
        topic: its topic.
        unit: SI unit.
    """

    name: str
    topic: str
    unit: str


def boundable_quantities(site: Site) -> list[BoundableQuantity]:
    """Find the scalar variables that rules of a site compare with something.

    Args:
        site: the site.

    Returns:
        The quantities, sorted by name.
    """
    found: dict[str, BoundableQuantity] = {}
    for kind in site.kinds:
        for rule in site.rules_for_kind(kind):
            for variable in _compared(lower(rule.terms[kind])):
                is_requested = variable.role is t.VariableRole.PARAMETER
                name = f"{kind}.{variable.name}" if is_requested else variable.name
                path = name.replace("[", "/").replace("]", "").replace(".", "/")
                unit = str(variable.type.dimension) if isinstance(variable.type, RealType) else ""
                topic = f"{PREFIX}/{'requested' if is_requested else 'measured'}/{path}"
                found[name] = BoundableQuantity(name, topic, "" if unit == "1" else unit)
    return sorted(found.values())


class BoundMessages:
    """Maker of the messages from records and measurements.

    Args:
        site: the site; decisions under another one bound nothing here, as their rules may be others.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self._units = {one.name: one.unit for one in boundable_quantities(site)}
        self._measured = {
            name: one
            for name, one in site.state.items()
            if any(part.name in self._units for part in scalar_variables(one.variable))
            or name in _names_in_rules(site)
        }
        self._actions = BoundsInForce()
        self._readings: dict[str, Reading] = {}
        """Newest reading of each variable that rules read."""
        self._configurations: set[str] = set()
        self._requested: set[str] = set()
        self._last = -inf

    def note_record(self, line: bytes) -> None:
        """Note what a record says of actions: they begin with their decision and end with the skill's step.

        Args:
            line: line of the audit log; ignored if it is no record.
        """
        try:
            record = json.loads(line)
        except ValueError:
            return
        event, details = record["event"], record["details"]
        skill = f"{details.get('module')}.{details.get('skill')}"
        if event in ("session-opened", "configuration-changed"):
            if (details.get("site") or {}).get("digest") == self._site.digest:
                self._configurations.add(details["configuration"])
        elif event == "decision" and details["decided"] is not None:
            if details.get("configuration") in self._configurations:
                decided = details["decided"]
                self._actions.begin(skill, self._site, decided["kind"], decided["parameters"])
            else:
                self._actions.end(skill)
        elif event in _ENDS:
            self._actions.end(skill)

    def measure(self, readings: Readings) -> Iterator[tuple[str, BoundedQuantity]]:
        """Note measurements, and make the messages that are due.

        A value that is malformed, not finite or older than its `max_age` is unknown, and has no message.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.

        Yields:
            Name of each quantity with its message.
        """
        self._readings.update((name, readings[name]) for name in self._measured if name in readings)
        now = max((reading.time for reading in readings.values()), default=-inf)
        if (now < self._last + PERIOD and now >= self._last) or not isfinite(now):
            return
        self._last = now
        values: dict[str, Value] = {}
        for name, reading in self._readings.items():
            one = self._measured[name]
            if one.max_age is None or now - reading.time <= one.max_age:
                values.update(scalars(one, reading.value))
        yield from self._messages(stamp(now), values)

    def _messages(self, when: Time, values: Mapping[str, Value]) -> Iterator[tuple[str, BoundedQuantity]]:
        bounds: dict[str, list[BoundInForce]] = {}
        for one in self._actions.find(values):
            bounds.setdefault(one.name, []).append(one)
        for name, unit in self._units.items():
            value = bounds[name][0].value if name in bounds else values.get(name)
            if isinstance(value, Fraction):
                yield name, _message(when, unit, float(value), bounds.get(name, []))
        requested = {name for name, found in bounds.items() if found[0].is_requested}
        # So that a plot does not go on with the values of an action that has ended.
        for name in sorted(self._requested - requested):
            yield name, BoundedQuantity(Header(when), self._units[name])
        self._requested = requested


def _message(when: Time, unit: str, value: float, bounds: list[BoundInForce]) -> BoundedQuantity:
    low, high = (-inf, ""), (inf, "")
    for rule, _, _, bound, _ in bounds:
        limit = float(bound.value)
        is_absolute = isinstance(bound.quantity, t.Absolute)
        if bound.is_upper:
            high = min(high, (limit, rule), key=_limit)
        if (bound.is_upper and is_absolute) or not (bound.is_upper or is_absolute):
            low = max(low, (-limit if is_absolute else limit, rule), key=_limit)
    lower_bound, upper_bound = (nan if isinf(limit) else limit for limit, _ in (low, high))
    return BoundedQuantity(Header(when), unit, value, lower_bound, upper_bound, low[1], high[1])


def _limit(one: tuple[float, str]) -> float:
    return one[0]


def _compared(term: t.Term) -> Iterator[t.Variable]:
    """Yield the real variables, or those in absolute values, that stand alone on a side of a comparison."""
    match term:
        case t.Not(operand=operand):
            yield from _compared(operand)
        case t.And(operands=operands) | t.Or(operands=operands):
            for operand in operands:
                yield from _compared(operand)
        case t.Compare(left=left, right=right):
            for side in (left, right):
                match side:
                    case t.Variable(type=RealType()) as variable:
                        yield variable
                    case t.Absolute(operand=t.Variable() as variable):
                        yield variable


def _names_in_rules(site: Site) -> frozenset[str]:
    terms = (term for rule in site.rules for term in rule.terms.values())
    return frozenset(name for term in terms for name in t.variables_of(term))

"""Time series of measured and requested quantities, with the bounds that the site's rules put on them.

A rule bounds a quantity while an action of a kind that it governs is in progress.  The bound is that of the
latest decided action, for the measurements at that time (`runtime.monitor.rule_bounds`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.apps.report_page.run_data import RecordedDecision, RunData
from aeros.runtime.monitor.rule_bounds import Bound, rule_bounds
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import EnumType, RealType
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

MAX_SAMPLES: Final = 4_000
"""Largest number of times at which bounds are evaluated; longer runs use every second, third … sample."""


class Limit(NamedTuple):
    """A bound that applies from a time on, until the next one.

    Attributes:
        time: Plant time (s) from which it applies.
        value: The bound, in the quantity's unit; None if nothing bounds the quantity from then on.
        rule: Id of the rule that it comes from.
    """

    time: float
    value: float | None
    rule: str


@dataclass
class PlottedQuantity:
    """One number over time, SI.

    Attributes:
        name: Name of the variable or parameter, with its component.
        unit: Its unit.
        upper, lower: Bounds on it by the rules of the actions under way.
        points: Plant time (s) and value.
        is_requested: True if it is a parameter of decided actions, not measured.  None in its points marks
            the end of the action.
        is_single: True if it is a scalar variable, not a component of a vector or family.
    """

    name: str
    unit: str
    is_requested: bool
    is_single: bool
    points: list[tuple[float, float | None]] = field(default_factory=list)
    upper: list[Limit] = field(default_factory=list)
    lower: list[Limit] = field(default_factory=list)


class ClosestApproach(NamedTuple):
    """The time at which a quantity had the smallest margin to a rule's bound.

    Attributes:
        rule: Id of the rule.
        quantity: Name of the quantity.
        unit: Unit of `measured` and `bound`.
        is_upper: True if `bound` is an upper bound, False if it is a lower one.
        measured: Value of the quantity at that time.
        bound: The rule's bound at that time.
        time: Plant time (s).
    """

    rule: str
    quantity: str
    unit: str
    is_upper: bool
    measured: float
    bound: float
    time: float

    @property
    def margin(self) -> float:
        """Distance to the bound, SI; negative if the rule was violated."""
        return self.bound - self.measured if self.is_upper else self.measured - self.bound


@dataclass
class Series:
    """Quantities of a run and the bounds on them.

    Attributes:
        quantities: Every quantity that was bounded at some time, by name.
        closest_approaches: Closest approach by rule and quantity; members of a family share one.
        sample_step: Bounds were evaluated at every n-th sample.
    """

    quantities: dict[str, PlottedQuantity] = field(default_factory=dict)
    closest_approaches: dict[tuple[str, str], ClosestApproach] = field(default_factory=dict)
    sample_step: int = 1


_TimelineItem = tuple[float, int, Any]
"""Time, rank within it, and a sample, a decision, or the name of a skill that ended."""


def build_series(left: RunData, sites: Mapping[str, Site]) -> Series:
    """Compute quantities, their bounds and the closest approach of each rule.

    Args:
        left: Data of the run.
        sites: Available sites by digest.

    Returns:
        The series.
    """
    timeline: list[_TimelineItem] = [(time, 0, state) for time, state in left.samples]
    timeline += [(one.time, 1, one) for one in left.decisions if one.decision != "DENY"]
    timeline += [(one.end_time, 2, one.skill) for one in left.runs if one.end_time is not None]
    timeline.sort(key=lambda item: item[:2])
    series = Series(sample_step=1 + len(timeline) // MAX_SAMPLES)
    walk = _TimelineWalker(series, sites)
    for number, (time, rank, what) in enumerate(timeline):
        match rank:
            case 0:
                walk.measure(time, what)
            case 1:
                walk.measure(time, what.state)
                walk.begin(what)
            case _:
                walk.end(what)
        if rank or number % series.sample_step == 0:
            walk.evaluate_bounds(time)
    return series


class _TimelineWalker:
    """Replay of a run: tracks the measurements and the actions in progress."""

    def __init__(self, series: Series, sites: Mapping[str, Site]) -> None:
        self._series = series
        self._sites = sites
        self._values: dict[str, Value] = {}
        self._under_way: dict[str, tuple[RecordedDecision, Site]] = {}
        self._terms: dict[tuple[str, str], list[tuple[str, t.Term]]] = {}
        self._declared = {name: one for site in sites.values() for name, one in site.state.items()}

    def measure(self, time: float, state: Mapping[str, Any]) -> None:
        """Record the measurements; skip malformed ones."""
        for name, pair in state.items():
            declared = self._declared.get(name)
            if declared is None or type(pair) is not list or len(pair) != 2:
                continue
            for scalar, value in _scalars(declared, pair[0]):
                self._values[scalar] = value
                if isinstance(value, Fraction):
                    quantity = self._quantity(scalar, declared, is_asked=False)
                    when = pair[1] if type(pair[1]) in (float, int) and isfinite(pair[1]) else time
                    if not quantity.points or quantity.points[-1][0] < when:
                        quantity.points.append((when, float(value)))

    def begin(self, one: RecordedDecision) -> None:
        """Start an action; it replaces the skill's previous one."""
        site = self._sites.get(one.site or "")
        if site is not None and one.kind in site.kinds:
            self._under_way[one.skill] = (one, site)

    def end(self, skill: str) -> None:
        """End the skill's action."""
        self._under_way.pop(skill, None)

    def evaluate_bounds(self, time: float) -> None:
        """Evaluate and record all bounds in force."""
        found: dict[tuple[str, bool], Limit] = {}
        for one, site in self._under_way.values():
            for rule, bound in self._bounds(one, site):
                self._add_bound(time, one, site, rule, bound, found)
        for quantity in self._series.quantities.values():
            is_over = (
                quantity.is_requested and not {(quantity.name, True), (quantity.name, False)} & found.keys()
            )
            if is_over and quantity.points[-1][1] is not None:
                quantity.points.append((time, None))
            for is_upper, limits in ((True, quantity.upper), (False, quantity.lower)):
                limit = found.get((quantity.name, is_upper), Limit(time, None, ""))
                if (limits or limit.value is not None) and (not limits or limits[-1][1:] != limit[1:]):
                    limits.append(limit)

    def _bounds(self, one: RecordedDecision, site: Site) -> Iterator[tuple[str, Bound]]:
        kind = site.kinds[one.kind]
        if (site.digest, kind.name) not in self._terms:
            terms = [(rule.id, lower(rule.terms[kind.name])) for rule in site.rules_for_kind(kind.name)]
            self._terms[site.digest, kind.name] = terms
        asked = {
            scalar: value
            for name, declared in kind.parameters.items()
            for scalar, value in _scalars(declared, one.decided.get(name))
        }
        for rule, term in self._terms[site.digest, kind.name]:
            for bound in rule_bounds(term, self._values | asked):
                yield rule, bound

    def _add_bound(
        self,
        time: float,
        one: RecordedDecision,
        site: Site,
        rule: str,
        bound: Bound,
        found: dict[tuple[str, bool], Limit],
    ) -> None:
        variable = bound.variable
        is_asked = variable.role is t.VariableRole.PARAMETER
        name = f"{one.kind}.{variable.name}" if is_asked else variable.name
        measured = self._requested_value(one, site, variable) if is_asked else self._values[variable.name]
        if not isinstance(measured, Fraction):
            return
        if is_asked:
            declared = site.kinds[one.kind].parameters[variable.name.partition(".")[0]]
            quantity = self._quantity(name, declared, is_asked=True)
            if not quantity.points or quantity.points[-1][1] != float(measured):
                quantity.points.append((time, float(measured)))
        shown = abs(measured) if isinstance(bound.quantity, t.Absolute) else measured
        self._note_nearest(rule, name, unparse(bound.quantity), bound, float(shown), time)
        if isinstance(bound.quantity, t.Variable):
            limit, key = Limit(time, float(bound.value), rule), (name, bound.is_upper)
            known = found.get(key)
            if known is None or known.value is None or _is_tighter(bound, known.value):
                found[key] = limit

    def _note_nearest(
        self, rule: str, name: str, spelt: str, bound: Bound, measured: float, time: float
    ) -> None:
        unit = self._series.quantities[name].unit
        nearest = ClosestApproach(rule, spelt, unit, bound.is_upper, measured, float(bound.value), time)
        # Members of a family share one entry: the closest.
        key = (rule, name.partition("[")[0])
        known = self._series.closest_approaches.get(key)
        if known is None or nearest.margin < known.margin:
            self._series.closest_approaches[key] = nearest

    def _requested_value(self, one: RecordedDecision, site: Site, variable: t.Variable) -> Value | None:
        name = variable.name.partition(".")[0]
        parameters = site.kinds[one.kind].parameters
        return dict(_scalars(parameters[name], one.decided.get(name))).get(variable.name)

    def _quantity(self, name: str, declared: Declared, *, is_asked: bool) -> PlottedQuantity:
        known = self._series.quantities.get(name)
        if known is None:
            variable = declared.variable
            single = scalar_variables(variable) == (variable,)
            type_ = scalar_variables(variable)[0].type
            unit = str(type_.dimension) if isinstance(type_, RealType) else ""
            known = PlottedQuantity(name, "" if unit == "1" else unit, is_asked, single)
            self._series.quantities[name] = known
        return known


def _is_tighter(bound: Bound, known: float) -> bool:
    return bound.value < known if bound.is_upper else bound.value > known


def _scalars(declared: Declared, value: Any) -> Sequence[tuple[str, Value]]:
    """Return the exact scalars of a recorded value; empty if it has the wrong form."""
    names = scalar_variables(declared.variable)
    parts = value if type(value) is list else [value]
    if len(parts) != len(names):
        return ()
    found: list[tuple[str, Value]] = []
    for variable, part in zip(names, parts, strict=True):
        match variable.type:
            case RealType():
                if type(part) not in (float, int) or not isfinite(part):
                    return ()
                found.append((variable.name, Fraction(part)))
            case EnumType(members=members):
                if part not in members:
                    return ()
                found.append((variable.name, part))
            case _:
                if type(part) is not bool:
                    return ()
                found.append((variable.name, part))
    return found

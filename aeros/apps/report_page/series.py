"""Time series of measured and requested quantities, with the bounds that the site's rules put on them.

A rule bounds a quantity while an action of a kind that it governs is in progress.  The bound is that of the
latest decided action, for the measurements at that time (`runtime.monitor.rule_bounds`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.apps.report_page.run_data import RecordedDecision, RunData
from aeros.runtime.monitor.bounds_in_force import BoundInForce, BoundsInForce, scalars
from aeros.runtime.monitor.rule_bounds import Bound
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import RealType
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

    @property
    def is_flat(self) -> bool:
        """True if neither its value nor a bound on it ever changed."""
        values = {value for _, value in self.points if value is not None}
        bounds = [
            {one.value for one in limits if one.value is not None} for limits in (self.upper, self.lower)
        ]
        return len(values) <= 1 and all(len(one) <= 1 for one in bounds)


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
        self._actions = BoundsInForce()
        self._declared = {name: one for site in sites.values() for name, one in site.state.items()}

    def measure(self, time: float, state: Mapping[str, Any]) -> None:
        """Record the measurements; skip malformed ones."""
        for name, pair in state.items():
            declared = self._declared.get(name)
            if declared is None or type(pair) is not list or len(pair) != 2:
                continue
            for scalar, value in scalars(declared, pair[0]):
                self._values[scalar] = value
                if isinstance(value, Fraction):
                    quantity = self._quantity(scalar, declared, is_asked=False)
                    when = pair[1] if type(pair[1]) in (float, int) and isfinite(pair[1]) else time
                    if not quantity.points or quantity.points[-1][0] < when:
                        quantity.points.append((when, float(value)))

    def begin(self, one: RecordedDecision) -> None:
        """Start an action; it replaces the skill's previous one."""
        site = self._sites.get(one.site or "")
        if site is not None:
            self._actions.begin(one.skill, site, one.kind, one.decided)

    def end(self, skill: str) -> None:
        """End the skill's action."""
        self._actions.end(skill)

    def evaluate_bounds(self, time: float) -> None:
        """Evaluate and record all bounds in force."""
        found: dict[tuple[str, bool], Limit] = {}
        for bound in self._actions.find(self._values):
            self._add_bound(time, bound, found)
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

    def _add_bound(self, time: float, one: BoundInForce, found: dict[tuple[str, bool], Limit]) -> None:
        name, bound = one.name, one.bound
        if one.is_requested:
            quantity = self._quantity(name, one.declared, is_asked=True)
            if not quantity.points or quantity.points[-1][1] != float(one.value):
                quantity.points.append((time, float(one.value)))
        shown = abs(one.value) if isinstance(bound.quantity, t.Absolute) else one.value
        self._note_nearest(one.rule, name, unparse(bound.quantity), bound, float(shown), time)
        if isinstance(bound.quantity, t.Variable):
            limit, key = Limit(time, float(bound.value), one.rule), (name, bound.is_upper)
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

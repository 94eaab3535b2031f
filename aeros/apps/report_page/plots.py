"""SVG plots over the plant's clock: a timeline of skills, and quantities with their bounds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from itertools import pairwise
from math import floor, log10
from typing import Final, NamedTuple

from aeros.apps.report_page.film_link import NO_FILM, FilmLink
from aeros.apps.report_page.run_data import RunData, SkillExecution, shortened
from aeros.apps.report_page.series import Limit, PlottedQuantity

_LEFT, _WIDTH, _RIGHT = 190, 900, 20
_LANE, _PLOT, _FOOT = 22, 130, 22
_MAX_BARS: Final = 2_000
_MAX_MARKS: Final = 500

COLOURS: Final = {
    "succeeded": "#0072b2",
    "failed": "#cc79a7",
    "denied": "#d55e00",
    "stopped": "#d55e00",
    "under way": "#8a8f94",
    "fault": "#009e73",
    "re-plan": "#009e73",
}
"""Four colours of Okabe and Ito and a grey, which colour-blind people tell apart on white and on black."""

_DASHED: Final = frozenset({"re-plan"})
"""Categories whose marks are dashed, as they share a colour with another kind of mark."""


class Mark(NamedTuple):
    """An event in a plot.

    Attributes:
        time: Plant time (s).
        category: A key of `COLOURS`.
        text: Text shown for it.
    """

    time: float
    category: str
    text: str


def collect_marks(left: RunData) -> list[Mark]:
    """Collect faults, stops, denials, re-plans and pauses.

    Args:
        left: Data of the run.

    Returns:
        The marks in order of time.
    """
    marks = [Mark(one.time, "fault", one.text) for one in left.events if one.kind.startswith("fault-")]
    marks += [
        Mark(run.end_time, "stopped", f"stop: {run.skill}: {run.reason or run.status}")
        for run in left.runs
        if run.end_time is not None and run.status not in ("finished", "denied")
    ]
    marks += [
        Mark(one.time, "denied", f"{one.skill} asks for {one.kind}: " + "; ".join(r[1] for r in one.reasons))
        for one in left.decisions
        if one.decision == "DENY"
    ]
    marks += [Mark(one.time, "re-plan", one.text) for one in left.events if one.kind == "replan"]
    marks += [Mark(time, "stopped", f"{what} by the operator") for time, what in left.pause_changes]
    return sorted(marks)


def category_of(run: SkillExecution) -> str:
    """Return the category of a skill run for its colour.

    Args:
        run: The run of a skill.

    Returns:
        A key of `COLOURS`.
    """
    if run.end_time is None:
        return "under way"
    if run.status != "finished":
        return "denied" if run.status == "denied" else "stopped"
    return "failed" if run.failed else "succeeded"


def timeline(left: RunData, marks: Sequence[Mark], link: FilmLink = NO_FILM) -> str:
    """Draw a lane of marks and a lane of bars for each skill.

    Args:
        left: Data of the run.
        marks: Marks to draw.
        link: Links the marks and the starts of the bars to the film; a cursor follows the film.

    Returns:
        An SVG element.
    """
    skills = list(dict.fromkeys(run.skill for run in left.runs))
    lanes = {skill: number for number, skill in enumerate(skills, 1)}
    axis = _TimeAxis(left.ends_at)
    height = (len(lanes) + 1) * _LANE
    parts = [*axis.grid(height), _label(_LANE / 2, "marks")]
    parts += [_label((lane + 0.5) * _LANE, skill) for skill, lane in lanes.items()]
    for run in left.runs[:_MAX_BARS]:
        end = left.ends_at if run.end_time is None else run.end_time
        x, top = axis.x(run.start_time), lanes[run.skill] * _LANE + 3
        tooltip = (
            f"{run.role} {run.skill}, {run.start_time:.2f} to {end:.2f} s: {run.result_text} {run.reason}"
        )
        parts.append(
            f'<rect x="{x:.1f}" y="{top:.0f}" width="{max(axis.x(end) - x, 1.5):.1f}" height="{_LANE - 6}"'
            f' rx="2" fill="{COLOURS[category_of(run)]}"{link.attribute(run.start_time)}>'
            f"{_title(tooltip)}</rect>"
        )
    parts += _mark_lines(marks, axis, _LANE, link)
    if link.span is not None:
        parts.append(
            f'<path id="cursor" display="none" data-left="{_LEFT}" data-width="{_WIDTH}"'
            f' data-end="{max(left.ends_at, 1e-9)}" d="M0 0V{height:.0f}" class="axis" stroke-width="1.5"'
            ' pointer-events="none"/>'
        )
    return _svg(height + _FOOT, "timeline of steps", parts)


def plot(quantity: PlottedQuantity, marks: Sequence[Mark], ends_at: float) -> str:
    """Plot a quantity as a line and its bounds as steps, with the forbidden region shaded.

    Args:
        quantity: The quantity and its bounds.
        marks: Marks to draw as vertical lines.
        ends_at: Plant time of the right edge, in seconds.

    Returns:
        An SVG element.
    """
    axis = _TimeAxis(ends_at)
    low, high = _span(quantity)
    y = _YAxis(low, high)
    parts = list(axis.grid(_PLOT))
    parts += [_shade(axis, y, limits, is_upper=is_upper) for is_upper, limits in _limits(quantity)]
    parts += [
        f'<text x="{_LEFT - 6}" y="{y(at) + 4:.1f}" text-anchor="end">{at:g} {escape(quantity.unit)}</text>'
        for at in (low, high)
    ]
    shown = f"asked for: {quantity.name}" if quantity.is_requested else quantity.name
    parts.append(_label(_PLOT / 2, shown))
    parts.append(_steps(quantity, axis, y, ends_at) if quantity.is_requested else _line(quantity, axis, y))
    for _, limits in _limits(quantity):
        parts += _bars(axis, y, [*limits, Limit(ends_at, None, "")], quantity.unit)
    parts += _mark_lines(marks, axis, _PLOT)
    return _svg(_PLOT + _FOOT, f"{shown} and its bounds", parts)


def _limits(quantity: PlottedQuantity) -> list[tuple[bool, list[Limit]]]:
    return [(True, quantity.upper), (False, quantity.lower)]


class _TimeAxis:
    """Horizontal axis of the plant's clock."""

    def __init__(self, ends_at: float) -> None:
        self._length = max(ends_at, 1e-9)

    def x(self, time: float) -> float:
        return _LEFT + _WIDTH * min(max(time / self._length, 0.0), 1.0)

    def grid(self, height: float) -> Iterator[str]:
        step = 10.0 ** floor(log10(self._length))
        step = next(step * part for part in (0.1, 0.2, 0.5, 1.0) if self._length / (step * part) <= 12)
        yield f'<rect x="{_LEFT}" y="0" width="{_WIDTH}" height="{height:.0f}" class="ground"/>'
        number = 0
        while number * step <= self._length:
            x = self.x(number * step)
            yield f'<path d="M{x:.1f} 0V{height:.0f}" class="grid"/>'
            yield f'<text x="{x:.1f}" y="{height + 15:.0f}" text-anchor="middle">{number * step:g} s</text>'
            number += 1


class _YAxis:
    def __init__(self, low: float, high: float) -> None:
        self._low, self._high = low, high

    def __call__(self, value: float) -> float:
        part = (value - self._low) / (self._high - self._low)
        return _PLOT - 6 - (_PLOT - 12) * min(max(part, 0.0), 1.0)


def _span(quantity: PlottedQuantity) -> tuple[float, float]:
    """Return the range of the vertical axis: all bounds, and values up to 2.5 times the largest bound."""
    values = [value for _, value in quantity.points if value is not None]
    bounds = [one.value for _, limits in _limits(quantity) for one in limits if one.value is not None]
    low, high = min([0.0, *values, *bounds]), max([*values, *bounds])
    if bounds:
        reach = 2.5 * max(abs(bound) for bound in bounds)
        low, high = max(low, -reach), min(high, reach)
    return (low, high) if high > low else (low, low + 1.0)


def _line(quantity: PlottedQuantity, axis: _TimeAxis, y: _YAxis) -> str:
    """Draw all points; if several share a pixel column, only the least and the greatest of them."""
    columns: dict[int, list[float]] = {}
    for time, value in quantity.points:
        if value is not None:
            columns.setdefault(round(axis.x(time) * 2), []).append(value)
    points = [
        (column / 2, value)
        for column, values in columns.items()
        for value in ((min(values), max(values)) if len(values) > 1 else values)
    ]
    path = " ".join(f"{x:.1f},{y(value):.1f}" for x, value in points)
    return f'<polyline points="{path}" fill="none" class="line" stroke-width="1.3"/>'


def _steps(quantity: PlottedQuantity, axis: _TimeAxis, y: _YAxis, ends_at: float) -> str:
    """Draw each requested value from its decision until the next one, or until the action was over."""
    path = ""
    for (time, value), (until, _) in pairwise([*quantity.points, (ends_at, None)]):
        if value is not None:
            path += f"M{axis.x(time):.1f} {y(value):.1f}H{axis.x(until):.1f}"
    return f'<path d="{path}" fill="none" class="line" stroke-width="1.3"/>'


def _shade(axis: _TimeAxis, y: _YAxis, limits: Sequence[Limit], *, is_upper: bool) -> str:
    parts = []
    for one, after in pairwise([*limits, Limit(float("inf"), None, "")]):
        if one.value is not None:
            x, edge = axis.x(one.time), y(one.value)
            top, bottom = (0.0, edge) if is_upper else (edge, float(_PLOT))
            parts.append(f"M{x:.1f} {top:.1f}H{axis.x(after.time):.1f}V{bottom:.1f}H{x:.1f}z")
    return f'<path d="{"".join(parts)}" fill="#d55e00" fill-opacity="0.13"/>'


def _bars(axis: _TimeAxis, y: _YAxis, limits: Sequence[Limit], unit: str) -> Iterator[str]:
    for one, after in pairwise(limits):
        if one.value is not None:
            tooltip = f"{one.rule}: {one.value:.4g} {unit} from {one.time:.2f} s"
            x, wide = axis.x(one.time), max(axis.x(after.time) - axis.x(one.time), 1.0)
            yield (
                f'<path d="M{x:.1f} {y(one.value):.1f}h{wide:.1f}" stroke="#d55e00" stroke-width="1.6">'
                f"{_title(tooltip)}</path>"
            )


def _mark_lines(
    marks: Sequence[Mark], axis: _TimeAxis, height: float, link: FilmLink = NO_FILM
) -> Iterator[str]:
    for mark in marks[:_MAX_MARKS]:
        seek = link.attribute(mark.time)
        dash = ' stroke-dasharray="4 2"' if mark.category in _DASHED else ""
        line = f'<path d="M{axis.x(mark.time):.1f} 0V{height:.0f}"{dash}'
        # A click hits an invisible wider line.
        target = f'{line} stroke="#000" stroke-opacity="0" stroke-width="8"/>' if seek else ""
        yield (
            f'<g{seek}>{line} stroke="{COLOURS[mark.category]}" stroke-width="1.5" stroke-opacity="0.7"/>'
            f"{target}{_title(f'{mark.time:.2f} s {mark.text}')}</g>"
        )


def _label(y: float, text: str) -> str:
    shown = escape(shortened(text, 40))
    return f'<text x="4" y="{y + 4:.0f}">{shown}{_title(text)}</text>'


def _title(text: str) -> str:
    return f"<title>{escape(shortened(text, 400))}</title>"


def _svg(height: float, title: str, parts: Iterable[str]) -> str:
    width = _LEFT + _WIDTH + _RIGHT
    return (
        f'<div class="scroll" tabindex="0"><svg viewBox="0 0 {width} {height:.0f}" width="{width}"'
        f' height="{height:.0f}" role="group" aria-label="{escape(title)}" font-family="sans-serif"'
        f' font-size="11">{_title(title)}{"".join(parts)}</svg></div>'
    )

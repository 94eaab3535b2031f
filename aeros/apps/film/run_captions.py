"""The caption of a run at each time, from its audit log and its samples."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.apps.film.reasons import (
    PERSON_DISTANCE,
    action_text,
    in_words,
    reason_text,
)
from aeros.apps.report_page.run_data import RecordedDecision, RunData, SkillExecution
from aeros.apps.report_page.series import PlottedQuantity, Series, build_series
from aeros.apps.rule_causes import RuleCause
from aeros.runtime.ports import Trajectory
from aeros.runtime.records.records import motion_from_json
from aeros.sim.film.captions import Caption, Detection, Gauge, PersonSeparation, Status, ZoneFigure
from aeros.spec.model.site import Site

_GAUGES: Final = (("tool_speed", "m/s", 1.0), ("contact_force", "N", 100.0), (PERSON_DISTANCE, "m", 3.0))
"""Quantity, unit and end of the scale of each gauge; another quantity of that unit if there is none."""

_SAMPLES: Final = 8
"""Points on each piece of a decided path."""

_IN_VOLUME: Final = re.compile(r"(- base_position )?(?:not )?in (\w+)")

_STOP_TIME: Final = 2.0
"""Time within which a stop ends, s."""

_FRESH: Final = 0.3
"""Age up to which a value counts as seen in a picture, s."""


class _State(NamedTuple):
    """Status from a time on."""

    time: float
    status: Status
    headline: str = ""
    rule: str = ""
    skill: str = ""
    decision: RecordedDecision | None = None
    needed: float | None = None
    slow: float | None = None


class RunCaptions:
    """Captions of a run. It is a `CaptionSource`.

    Args:
        run: data of the run.
        sites: sites of the run that are available, by digest.
    """

    def __init__(self, run: RunData, sites: Mapping[str, Site]) -> None:
        self._series: Series = build_series(run, sites)
        self._sites = sites
        self._states = _states_of(run)
        self._times = [one.time for one in self._states]
        looks = [
            one for one in run.decisions if one.decision != "DENY" and type(one.decided.get("camera")) is str
        ]
        self._looks = looks
        self._look_times = [one.time for one in looks]
        self._decisions = run.decisions
        self._decision_times = [one.time for one in run.decisions]
        self._paths: dict[int, tuple[tuple[float, ...], ...]] = {}
        self._slow = min((one.slow for one in self._states if one.slow is not None), default=None)

    def __call__(self, time: float) -> Caption:
        """Return the caption at a time, s."""
        index = bisect_right(self._times, time) - 1
        if index < 0:
            return Caption()
        state = self._states[index]
        decision = state.decision
        camera, pictured_at, detections = self._sight(time)
        needed = self._needed(index, time)
        measured = self._value(PERSON_DISTANCE, time)
        return Caption(
            state.status,
            state.headline,
            state.rule,
            state.skill,
            _action(state),
            state.time,
            tuple(self._gauges(time, state, needed)),
            None if needed is None else PersonSeparation(measured, needed, self._slow),
            self._path(decision) if state.status in ("allowed", "slowed") else (),
            tuple(self._zones(decision)),
            camera,
            pictured_at,
            detections,
        )

    # Internals.

    def _value(self, name: str, time: float) -> float | None:
        quantity = self._series.quantities.get(name)
        if quantity is None:
            return None
        index = bisect_right(quantity.points, (time, float("inf"))) - 1
        return quantity.points[index][1] if index >= 0 else None

    def _quantity(self, name: str, unit: str) -> PlottedQuantity | None:
        """Return the quantity of a name, or else the first one of a unit that is bounded."""
        quantities = self._series.quantities
        if name in quantities:
            return quantities[name]
        return next(
            (
                one
                for one in quantities.values()
                if one.unit == unit and one.is_single and not one.is_requested
            ),
            None,
        )

    def _gauges(self, time: float, state: _State, needed: float | None) -> Iterator[Gauge]:
        for name, unit, full in _GAUGES:
            quantity = self._quantity(name, unit)
            if quantity is None:
                continue
            is_person = quantity.name == PERSON_DISTANCE
            is_upper = not is_person and bool(quantity.upper)
            bound = needed if is_person else _limit_at(quantity, time, is_upper=is_upper)
            speed = None if state.decision is None else state.decision.decided.get("speed")
            if unit == "m/s" and type(speed) is float and (bound is None or speed < bound):
                bound = speed
            label = "person" if is_person else in_words(quantity.name)
            scale = max(full, 1.15 * bound) if bound is not None and bound < 5.0 * full else full
            yield Gauge(label, self._value(quantity.name, time), bound, is_upper, unit, scale)

    def _needed(self, index: int, time: float) -> float | None:
        """Return the distance that people must keep: of the action under way, or else the latest one."""
        quantity = self._series.quantities.get(PERSON_DISTANCE)
        if self._states[index].status in ("allowed", "slowed") and quantity is not None:
            bound = _limit_at(quantity, time, is_upper=False)
            if bound is not None:
                return bound
        for state in reversed(self._states[: index + 1]):
            if state.needed is not None:
                return state.needed
        limits = () if quantity is None else quantity.lower
        return next((one.value for one in limits if one.value is not None), None)

    def _path(self, decision: RecordedDecision | None) -> tuple[tuple[float, ...], ...]:
        if decision is None or not decision.motion:
            return ()
        if decision.sequence not in self._paths:
            self._paths[decision.sequence] = tuple(_joint_path(decision.motion))
        return self._paths[decision.sequence]

    def _zones(self, decision: RecordedDecision | None) -> Iterator[ZoneFigure]:
        site = None if decision is None else self._sites.get(decision.site or "")
        if decision is None or site is None:
            return
        broken = {
            match[2]: bool(match[1])
            for cause in decision.causes
            for match in _IN_VOLUME.finditer(cause.text)
            if match[2] in site.volumes
        }
        base = _point(_measured(decision, "base_position")) or (0.0, 0.0, 0.0)
        target = _point(decision.requested.get("target"))
        for name, volume in site.volumes.items():
            low, high = _corners(volume.lower), _corners(volume.upper)
            if name in broken and decision.decision == "DENY":
                off = base if broken[name] else (0.0, 0.0, 0.0)
                yield ZoneFigure(name, _shifted(low, off), _shifted(high, off), is_broken=True)
            elif (
                "work_area" in site.offers.get(name, ())
                and target is not None
                and _is_inside(target, low, high)
            ):
                yield ZoneFigure(name, low, high, is_broken=False)

    def _sight(self, time: float) -> tuple[str, float, tuple[Detection, ...]]:
        index = bisect_right(self._look_times, time) - 1
        if index < 0:
            return "", 0.0, ()
        look = self._looks[index]
        after = self._decisions[bisect_right(self._decision_times, time) - 1]
        seen = []
        for name, pair in after.state.items():
            point = _point(_measured(after, name))
            if "." in name and point is not None and type(pair) is list and abs(pair[1] - look.time) < _FRESH:
                seen.append(Detection(in_words(name.removesuffix("_position")), point))
        return str(look.decided["camera"]), look.time, tuple(seen)


def _action(state: _State) -> str:
    if state.decision is None:
        return ""
    text = action_text(state.decision.kind, state.decision.requested, state.decision.decided)
    return f"asked for: {text}" if state.status in ("denied", "waiting") else text


def _states_of(run: RunData) -> list[_State]:
    """Return the status of a run over time."""
    states = [_decided(one) for one in run.decisions]
    states += [
        _State(_stop_time(run, one.end_time), *_ended(one), skill=one.skill, needed=_needed_of(one.causes))
        for one in run.runs
        if one.end_time is not None and one.status not in ("finished", "denied")
    ]
    for event in run.events:
        if event.kind == "wait-started":
            states.append(_State(event.time, "waiting"))
        elif event.kind == "run-ended":
            reached = event.details.get("reached") is True
            states.append(_State(event.time, "reached" if reached else "failed", event.text))
    states += [_State(time, "paused" if kind == "paused" else "idle") for time, kind in run.pause_changes]
    # At the same time it is stopped first, then denied what it asks for, and then waits.
    states.sort(key=lambda one: (one.time, one.status != "stopped", one.status == "waiting"))
    filled: list[_State] = []
    for one in states:
        before = filled[-1] if filled else None
        if one.status == "waiting" and before is not None:
            # Whatever was denied is what it waits for.
            one = before._replace(time=one.time, status="waiting")
        filled.append(one)
    return filled


def _decided(one: RecordedDecision) -> _State:
    statuses: dict[str, Status] = {"ALLOW": "allowed", "ATTENUATE": "slowed", "DENY": "denied"}
    status = statuses.get(one.decision, "denied")
    slow = [
        part.bound
        for cause in one.causes
        for part in cause.shortfalls
        if part.quantity == PERSON_DISTANCE and status == "slowed"
    ]
    return _State(
        one.time,
        status,
        reason_text(one.causes) or "; ".join(text for _, _, text in one.reasons),
        ", ".join(cause.rule for cause in one.causes),
        one.skill,
        one,
        _needed_of(one.causes) if status == "denied" else None,
        min(slow, default=None),
    )


def _stop_time(run: RunData, ended: float) -> float:
    """Return when the stop began that ended a step, s; the time of its end if none is recorded."""
    began = [time for time, _ in run.stops if ended - _STOP_TIME <= time <= ended]
    return max(began, default=ended)


def _ended(one: SkillExecution) -> tuple[Status, str, str]:
    return "stopped", reason_text(one.causes) or one.reason, ", ".join(cause.rule for cause in one.causes)


def _needed_of(causes: Sequence[RuleCause]) -> float | None:
    """Return the distance that a person had to keep by rules that say nothing else."""
    bounds = [
        cause.shortfalls[0].bound
        for cause in causes
        if len(cause.shortfalls) == 1 and cause.shortfalls[0].quantity == PERSON_DISTANCE
    ]
    return min(bounds, default=None)


def _limit_at(quantity: PlottedQuantity, time: float, *, is_upper: bool) -> float | None:
    limits = quantity.upper if is_upper else quantity.lower
    index = bisect_right([one.time for one in limits], time) - 1
    return limits[index].value if index >= 0 else None


def _joint_path(motion: Mapping[str, Any]) -> Iterator[tuple[float, ...]]:
    """Yield joint positions along the first path of a motion: pieces are cubic Bezier curves."""
    try:
        plan = motion_from_json(dict(motion), {str(motion.get("body")): None})
    except (KeyError, TypeError, ValueError):
        return
    if not isinstance(plan, Trajectory) or not plan.joint_paths:
        return
    pieces = plan.joint_paths[0]
    step = max(1, len(pieces) // _SAMPLES)
    for a, b, c, d in pieces[::step]:
        for number in range(_SAMPLES if step == 1 else 1):
            u = number / _SAMPLES
            v = 1.0 - u
            weights = (v * v * v, 3.0 * v * v * u, 3.0 * v * u * u, u * u * u)
            yield tuple(
                sum(weight * part for weight, part in zip(weights, parts, strict=True))
                for parts in zip(a, b, c, d, strict=True)
            )
    yield tuple(pieces[-1][3])


def _measured(decision: RecordedDecision, name: str) -> object:
    pair = decision.state.get(name)
    return pair[0] if type(pair) is list and len(pair) == 2 and _is_number(pair[1]) else None


def _point(value: object) -> tuple[float, float, float] | None:
    if type(value) is list and len(value) == 3 and all(map(_is_number, value)):
        x, y, z = map(float, value)
        return (x, y, z)
    return None


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and isfinite(value)


def _corners(corner: Sequence[Any]) -> tuple[float, float, float]:
    x, y, z = map(float, corner)
    return (x, y, z)


def _shifted(
    point: tuple[float, float, float], off: tuple[float, float, float]
) -> tuple[float, float, float]:
    return (point[0] + off[0], point[1] + off[1], point[2] + off[2])


def _is_inside(point: Sequence[float], low: Sequence[float], high: Sequence[float]) -> bool:
    return all(a <= one <= b for a, one, b in zip(low, point, high, strict=True))

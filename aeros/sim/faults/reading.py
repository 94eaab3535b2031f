"""A faults file → faults; every problem in it is reported with its place, and none is passed over."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import hypot
from pathlib import Path
from typing import Any, Final

import aeros
from aeros.runtime.ports import Triple
from aeros.sim.channel import Channel, Process, shortest
from aeros.sim.clock import TICK
from aeros.sim.faults.model import (
    Acting,
    Bump,
    Delay,
    Enter,
    Fault,
    Loosen,
    Misplace,
    Misread,
    Miss,
    OnLook,
    OnSkill,
    OnTime,
    Opportunity,
    Seen,
    Slip,
    Weaken,
)
from aeros.sim.people_file import person_of
from aeros.sim.sensing import SensorModel
from aeros.spec.declared import faults as declared
from aeros.spec.declared.people import Person
from aeros.spec.decode import decode
from aeros.spec.diagnostics import Diagnostic, Diagnostics, did_you_mean
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.errors import UserError
from aeros.spec.expr.types import FamilyType, RealType, VectorType
from aeros.spec.located import Number, Text
from aeros.spec.model import Declared
from aeros.spec.reader import read_yaml
from aeros.spec.source import Source, Span
from aeros.spec.texts import read_source
from aeros.spec.units import FORCE, LENGTH, TIME, Dimension

_KINDS: Final = (
    "bump",
    "slip",
    "loosen",
    "weaken",
    "delay",
    "misread",
    "enter",
    "miss",
    "misplace",
)
_PER: Final = ("skill", "look", "every")
_IMPULSE: Final = FORCE * TIME
_PUSH_TIME: Final = 12
"""How long a push lasts that does not say, ticks (50 ms)."""

_LONGEST: Final = 3600
"""Longest time that a faults file may speak of, s: more than any task takes."""

_STRONGEST: Final = 10
"""Largest impulse (N·s), grip force (tens of N) and offset (m) that mean anything on a table."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a faults file may name.

    quantities: what the site says is measured; skills: as `MODULE.SKILL`.
    things, cameras: of the scene.
    """

    quantities: Mapping[str, Declared]
    skills: Collection[str]
    things: Collection[str]
    cameras: Collection[str]


def shipped_faults() -> dict[str, Path]:
    """The faults files that come with AEROS, by name."""
    return {path.stem: path for path in sorted((Path(aeros.__file__).parent / "faults").glob("*.yaml"))}


def read_faults(name_or_path: str, around: Surroundings) -> tuple[Fault, ...]:
    """Those of a file, or of a shipped one by its name; raises `UserError` with every problem there is."""
    shipped = shipped_faults()
    if name_or_path in shipped:
        return faults_of(read_source(shipped[name_or_path]), around)
    if not os.path.lexists(name_or_path):
        near = did_you_mean(name_or_path, shipped)
        listed = ", ".join(f"`{name}`" for name in shipped)
        headline = f"there is no file `{name_or_path}`, and no faults of that name come with AEROS"
        help_ = (f"did you mean `{near}`?" if near else f"give a faults file, or one of {listed}",)
        raise UserError([Diagnostic("AE002", headline, help=help_)])
    return faults_of(read_source(name_or_path), around)


def faults_of(source: Source, around: Surroundings) -> tuple[Fault, ...]:
    """The faults that `source` declares; raises `UserError` with every problem there is."""
    sink = Diagnostics()
    node = read_yaml(source, sink)
    file = None if node is None else decode(node, declared.Faults, sink)
    found = [] if file is None else [_fault(str(name), one, around, sink) for name, one in file.faults]
    sink.raise_if_errors()
    return tuple(one for one in found if one is not None)


def _fault(name: str, one: declared.Fault, around: Surroundings, sink: Diagnostics) -> Fault | None:
    at = _opportunity(one.at, around, sink)
    process = _process(one, sink)
    word = _the_one(one, _KINDS, one.key_span, f"`{name}`", sink)
    kind = None if word is None else _kind(name, getattr(one, word), around, sink)
    if at is None or process is None or word is None or kind is None:
        return None
    if isinstance(kind, Miss | Misplace) is not isinstance(at, OnLook):
        wanted = "`look`" if isinstance(kind, Miss | Misplace) else "`skill` or `every`"
        sink.error(
            "AE208",
            f"`{word}` goes with {wanted} alone",
            one.at.span,
            help=("what a camera sees goes wrong by looks, what bodies and motors do by skills or by time",),
        )
        return None
    return Fault(name, at, process, kind, None if one.at_most is None else one.at_most.value)


def _the_one(one: Any, names: tuple[str, ...], span: Span, what: str, sink: Diagnostics) -> str | None:
    """Which of the fields is there; reports where none is or several are."""
    there = [name for name in names if getattr(one, name) is not None]
    if len(there) == 1:
        return there[0]
    said = " and ".join(f"`{name}`" for name in there) or "none"
    listed = ", ".join(f"`{name}`" for name in names)
    sink.error("AE208", f"{what} needs exactly one of {listed}; it has {said}", span)
    return None


# When.


def _opportunity(at: declared.At, around: Surroundings, sink: Diagnostics) -> Opportunity | None:
    word = _the_one(at, _PER, at.span, "`at`", sink)
    if word is None:
        return None
    after = 0 if at.after is None else _ticks(at.after, sink, least=0)
    waits = at.once or at.after
    if waits is not None and word != "skill":
        sink.error("AE208", "`once` and `after` go with `skill` alone", waits.span)
        return None
    if at.during is not None and word != "look":
        sink.error("AE208", "`during` goes with `look` alone", at.during.span)
        return None
    if at.skill is not None:
        if not _is_known(at.skill, around.skills, "skill of a loaded module", sink) or after is None:
            return None
        return OnSkill(at.skill.value, after, at.once is not None)
    if at.look is not None:
        known = _is_known(at.look, around.cameras, "camera of the scene", sink)
        if at.during is None:
            return OnLook(at.look.value) if known else None
        known = _is_known(at.during, around.skills, "skill of a loaded module", sink) and known
        return OnLook(at.look.value, at.during.value) if known else None
    period = None if at.every is None else _ticks(at.every, sink)
    return None if period is None else OnTime(period)


def _is_known(name: Text, known: Collection[str], what: str, sink: Diagnostics) -> bool:
    if name.value in known:
        return True
    near = did_you_mean(name.value, known)
    listed = ", ".join(f"`{one}`" for one in sorted(known)) or "there is none"
    help_ = (f"did you mean `{near}`?",) if near else (f"known: {listed}",)
    sink.error("AE122", f"`{name.value}` is no {what}", name.span, help=help_)
    return False


# How often.


def _process(one: declared.Fault, sink: Diagnostics) -> Process | None:
    rate, bursts = one.rate.value, one.bursts
    if bursts is None:
        return Process(0.0, 0.0, 1.0, 1.0, float(rate))
    within = Fraction(1) if bursts.within is None else bursts.within.value
    between = Fraction(0) if bursts.between is None else bursts.between.value
    length = bursts.mean_length.value
    if not between < rate < within:
        sink.error(
            "AE208",
            f"a rate of {float(rate):g} does not come of bursts with {float(within):g} within "
            f"and {float(between):g} between",
            one.rate.span,
            help=("choose `between` below `rate` and `within` above it",),
        )
        return None
    least = shortest((rate - between) / (within - between))
    if length < least:
        sink.error(
            "AE208",
            f"bursts of {float(length):g} are too short for this rate",
            bursts.mean_length.span,
            help=(f"a `mean_length` of at least {float(least):.4g} gives it",),
        )
        return None
    return Channel(rate, length, within, between).process()


# What.


def _kind(name: str, one: Any, around: Surroundings, sink: Diagnostics) -> Acting | Seen | None:
    match one:
        case declared.Bump():
            return _bump(one, around, sink)
        case declared.Slip():
            lasts = _ticks(one.lasts, sink)
            return None if lasts is None else Slip(float(one.friction.value), lasts)
        case declared.Loosen():
            force, lasts = _quantity(one.force, FORCE, 10 * _STRONGEST, sink), _ticks(one.lasts, sink)
            return None if force is None or lasts is None else Loosen(float(force), lasts)
        case declared.Weaken():
            lasts = _ticks(one.lasts, sink)
            return None if lasts is None else Weaken(float(one.torque.value), lasts)
        case declared.Delay():
            by, lasts = _ticks(one.by, sink), _ticks(one.lasts, sink)
            return None if by is None or lasts is None else Delay(by, lasts)
        case declared.Misread():
            return _misread(one, around, sink)
        case Person():
            return Enter(person_of(name, one, sink))
        case declared.Misplace():
            by_m, way = _quantity(one.by, LENGTH, _STRONGEST, sink), _way(one.direction, sink)
            return None if by_m is None or way is _WRONG else Misplace(float(by_m), way)
        case _:
            return Miss()


def _bump(one: declared.Bump, around: Surroundings, sink: Diagnostics) -> Bump | None:
    known = _is_known(one.thing, around.things, "thing of the scene", sink)
    impulse = _quantity(one.impulse, _IMPULSE, _STRONGEST, sink)
    over = _PUSH_TIME if one.over is None else _ticks(one.over, sink)
    way = _way(one.direction, sink)
    if not known or impulse is None or over is None or way is _WRONG:
        return None
    return Bump(one.thing.value, float(impulse), over, way)


def _misread(one: declared.Misread, around: Surroundings, sink: Diagnostics) -> Misread | None:
    if not _is_known(one.of, around.quantities, "quantity of the site", sink):
        return None
    type_ = around.quantities[one.of.value].variable.type
    element = type_.element if isinstance(type_, FamilyType) else type_
    noise = latency = Fraction(0)
    if one.noise is not None and isinstance(element, RealType | VectorType):
        noise = _quantity(one.noise, element.dimension, 1000, sink) or noise
    elif one.noise is not None:
        sink.error("AE208", f"`{one.of.value}` is no number, and has no noise", one.noise.span)
    if one.latency is not None:
        latency = _quantity(one.latency, TIME, _LONGEST, sink) or latency
    dropout = Fraction(0) if one.dropout is None else one.dropout.value
    if one.noise is None and one.latency is None and one.dropout is None:
        sink.error("AE208", "a misread needs `noise`, `latency` or `dropout`", one.span)
    lasts = _ticks(one.lasts, sink)
    if lasts is None or sink.has_errors:
        return None
    model = SensorModel(noise=float(noise), latency=float(latency), dropout=float(dropout))
    return Misread(one.of.value, model, lasts)


_WRONG: Final[Triple] = (0.0, 0.0, 0.0)
"""No direction, and reported."""


def _way(numbers: tuple[Number, ...] | None, sink: Diagnostics) -> Triple | None:
    """The direction, of length 1; None where there is none to take."""
    if numbers is None:
        return None
    x, y, z = (float(number.value) for number in numbers)
    length = hypot(x, y, z)
    if not 1e-6 < length < 1e6:
        sink.error("AE208", "a direction is not nothing", numbers[0].span.cover(numbers[-1].span))
        return _WRONG
    return (x / length, y / length, z / length)


def _ticks(text: Text, sink: Diagnostics, *, least: int = 1) -> int | None:
    """A time in whole ticks, rounded; at least `least`."""
    time = _quantity(text, TIME, _LONGEST, sink)
    if time is None:
        return None
    ticks = round(float(time) / TICK)
    if ticks >= least:
        return ticks
    sink.error(
        "AE111", f"`{text.value}` is shorter than a control tick", text.span, help=("a tick is 1/240 s",)
    )
    return None


def _quantity(text: Text, dimension: Dimension, most: int, sink: Diagnostics) -> Fraction | None:
    value = elaborate_quantity(text, dimension, sink)
    if value is None or 0 <= value <= most:
        return value
    help_ = (f"write a value from 0 to {most} {dimension}",)
    sink.error("AE111", f"`{text.value}` is outside its bounds", text.span, help=help_)
    return None

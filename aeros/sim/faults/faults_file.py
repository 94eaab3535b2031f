"""A faults file → faults; every problem in it is reported with its place, and none is passed over."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import hypot
from pathlib import Path
from typing import Any, Final

from aeros.runtime.ports import Vec3
from aeros.sim.bullet.people_file import parse_person
from aeros.sim.clock import TICK
from aeros.sim.faults.model import (
    CameraOpportunity,
    DetectionFault,
    Fault,
    Opportunity,
    PersonEntersFault,
    PhysicalFault,
    SkillOpportunity,
    TimedOpportunity,
)
from aeros.sim.gilbert_elliott import GilbertElliottModel, GilbertElliottProcess, min_mean_burst
from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.declared import faults as declared
from aeros.spec.declared.decode import decode
from aeros.spec.declared.faults import (
    KINDS,
    LONGEST,
    Amount,
    Deviation,
    Direction,
    DisplacedDetectionFault,
    Duration,
    Known,
    Mark,
    MissedDetectionFault,
    SensorFault,
    Share,
    marks_of,
)
from aeros.spec.declared.people import Person
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.types import FamilyType, RealType, VectorType
from aeros.spec.expr.units import TIME, Dimension
from aeros.spec.model.model import Declared
from aeros.spec.text.fields import NumberField, TextField
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

_OPPORTUNITY_KEYS: Final = ("skill", "look", "every")


@dataclass(frozen=True, slots=True)
class FaultContext:
    """What a faults file may name.

    quantities: what the site says is measured; skills: as `MODULE.SKILL`.
    things, cameras: of the scene.
    """

    quantities: Mapping[str, Declared]
    skills: Collection[str]
    things: Collection[str]
    cameras: Collection[str]


def shipped_faults() -> dict[str, Path]:
    """Return the faults files that come with AEROS, by name."""
    return shipped_files("faults")


def read_faults(name_or_path: str, context: FaultContext) -> tuple[Fault, ...]:
    """Those of a file, or of a shipped one by its name; raises `UserError` with every problem there is."""
    path = find_file(name_or_path, shipped_faults(), "faults file", "no faults of that name come")
    return parse_faults(read_source(path), context)


def parse_faults(source: Source, around: FaultContext) -> tuple[Fault, ...]:
    """The faults that `source` declares; raises `UserError` with every problem there is."""
    sink = Diagnostics()
    node = read_yaml(source, sink)
    file = None if node is None else decode(node, declared.Faults, sink)
    found = [] if file is None else [_fault(str(name), one, around, sink) for name, one in file.faults]
    sink.raise_if_errors()
    return tuple(one for one in found if one is not None)


def _fault(name: str, one: declared.Fault, around: FaultContext, sink: Diagnostics) -> Fault | None:
    at = _opportunity(one.at, around, sink)
    process = _process(one, sink)
    word = _exactly_one(one, tuple(KINDS), one.key_span, f"`{name}`", sink)
    kind = None if word is None else _kind(name, word, getattr(one, word), around, sink)
    if at is None or process is None or word is None or kind is None:
        return None
    if isinstance(kind, MissedDetectionFault | DisplacedDetectionFault) is not isinstance(
        at, CameraOpportunity
    ):
        wanted = (
            "`look`"
            if isinstance(kind, MissedDetectionFault | DisplacedDetectionFault)
            else "`skill` or `every`"
        )
        sink.error(
            "AE208",
            f"`{word}` goes with {wanted} alone",
            one.at.span,
            help=("what a camera sees goes wrong by looks, what bodies and motors do by skills or by time",),
        )
        return None
    return Fault(name, at, process, kind, None if one.at_most is None else one.at_most.value)


def _exactly_one(
    one: Any, names: tuple[str, ...], span: SourceSpan, what: str, sink: Diagnostics
) -> str | None:
    """Which of the fields is there; reports where none is or several are."""
    there = [name for name in names if getattr(one, name) is not None]
    if len(there) == 1:
        return there[0]
    said = " and ".join(f"`{name}`" for name in there) or "none"
    listed = ", ".join(f"`{name}`" for name in names)
    sink.error("AE208", f"{what} needs exactly one of {listed}; it has {said}", span)
    return None


# When.


def _opportunity(at: declared.FaultTrigger, around: FaultContext, sink: Diagnostics) -> Opportunity | None:
    word = _exactly_one(at, _OPPORTUNITY_KEYS, at.span, "`at`", sink)
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
        return SkillOpportunity(at.skill.value, after, at.once is not None)
    if at.look is not None:
        known = _is_known(at.look, around.cameras, "camera of the scene", sink)
        if at.during is None:
            return CameraOpportunity(at.look.value) if known else None
        known = _is_known(at.during, around.skills, "skill of a loaded module", sink) and known
        return CameraOpportunity(at.look.value, at.during.value) if known else None
    period = None if at.every is None else _ticks(at.every, sink)
    return None if period is None else TimedOpportunity(period)


def _is_known(name: TextField, known: Collection[str], what: str, sink: Diagnostics) -> bool:
    if name.value in known:
        return True
    near = did_you_mean(name.value, known)
    listed = ", ".join(f"`{one}`" for one in sorted(known)) or "there is none"
    help_ = (f"did you mean `{near}`?",) if near else (f"known: {listed}",)
    sink.error("AE122", f"`{name.value}` is no {what}", name.span, help=help_)
    return False


# How often.


def _process(one: declared.Fault, sink: Diagnostics) -> GilbertElliottProcess | None:
    rate, bursts = one.rate.value, one.bursts
    if bursts is None:
        return GilbertElliottProcess(0.0, 0.0, 1.0, 1.0, float(rate))
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
    least = min_mean_burst((rate - between) / (within - between))
    if length < least:
        sink.error(
            "AE208",
            f"bursts of {float(length):g} are too short for this rate",
            bursts.mean_length.span,
            help=(f"a `mean_length` of at least {float(least):.4g} gives it",),
        )
        return None
    return GilbertElliottModel(rate, length, within, between).process()


# What.


def _kind(
    name: str, word: str, one: Any, around: FaultContext, sink: Diagnostics
) -> PhysicalFault | DetectionFault | None:
    if isinstance(one, Person):
        return PersonEntersFault(parse_person(name, one, sink))
    kind, values = KINDS[word], dict[str, object]()
    for field, mark in marks_of(kind).items():
        written = getattr(one, field)
        if written is not None:
            values[field] = _value(mark, written, one, around, sink)
        if field == "of" and values[field] is None:
            return None  # what the other fields may be depends on it
    if kind is SensorFault and values.keys() == {"of", "lasts"}:
        sink.error("AE208", "a misread needs `noise`, `latency` or `dropout`", one.span)
        return None
    found: PhysicalFault | DetectionFault | None = None if None in values.values() else kind(**values)
    return found


def _value(mark: Mark, written: Any, one: Any, around: FaultContext, sink: Diagnostics) -> object:
    """Return the value in SI of a field of `one`, by its mark; None where it is wrong, and reported."""
    match mark:
        case Known(among=among, noun=noun):
            return written.value if _is_known(written, getattr(around, among), noun, sink) else None
        case Amount(dimension=dimension, most=most):
            return _quantity(written, dimension, most, sink)
        case Deviation():
            return _deviation(written, one.of, around, sink)
        case Duration():
            return _ticks(written, sink)
        case Share():
            return float(written.value)
        case Direction():
            return _direction(written, sink)


def _deviation(text: TextField, of: TextField, around: FaultContext, sink: Diagnostics) -> float | None:
    """Return a standard deviation of the known quantity `of`; None where it is wrong and reported."""
    type_ = around.quantities[of.value].variable.type
    element = type_.element if isinstance(type_, FamilyType) else type_
    if isinstance(element, RealType | VectorType):
        return _quantity(text, element.dimension, 1000, sink)
    sink.error("AE208", f"`{of.value}` is no number, and has no noise", text.span)
    return None


def _direction(numbers: tuple[NumberField, ...], sink: Diagnostics) -> Vec3 | None:
    """Return the direction with length 1; None where it has none, which is reported."""
    x, y, z = (float(number.value) for number in numbers)
    length = hypot(x, y, z)
    if not 1e-6 < length < 1e6:
        sink.error("AE208", "a direction is not nothing", numbers[0].span.merge(numbers[-1].span))
        return None
    return (x / length, y / length, z / length)


def _ticks(text: TextField, sink: Diagnostics, *, least: int = 1) -> int | None:
    """A time in whole ticks, rounded; at least `least`."""
    time = _quantity(text, TIME, LONGEST, sink)
    if time is None:
        return None
    ticks = round(time / TICK)
    if ticks >= least:
        return ticks
    sink.error(
        "AE111", f"`{text.value}` is shorter than a control tick", text.span, help=("a tick is 1/240 s",)
    )
    return None


def _quantity(text: TextField, dimension: Dimension, most: int, sink: Diagnostics) -> float | None:
    value = elaborate_quantity(text, dimension, sink)
    if value is None:
        return None
    if 0 <= value <= most:
        return float(value)
    help_ = (f"write a value from 0 to {most} {dimension}",)
    sink.error("AE111", f"`{text.value}` is outside its bounds", text.span, help=help_)
    return None

"""Read a faults file: check it, report every problem with its place, and resolve names and units."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import hypot
from pathlib import Path
from typing import Any, Final

from aeros.runtime.ports import Vec3
from aeros.sim.clock import TICK
from aeros.sim.engine.people_file import parse_person
from aeros.sim.faults.model import (
    CameraOpportunity,
    Fault,
    Opportunity,
    PersonEntersFault,
    PhysicalFault,
    PictureFault,
    SkillOpportunity,
    TimedOpportunity,
)
from aeros.sim.gilbert_elliott import GilbertElliottModel, GilbertElliottProcess, min_mean_burst
from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.declared import faults as declared
from aeros.spec.declared.decode import decode
from aeros.spec.declared.faults import (
    KINDS,
    LEAST_EDGE,
    LONGEST,
    MAX_COORDINATE,
    MOST_EDGE,
    Amount,
    Deviation,
    Direction,
    Duration,
    Edges,
    Known,
    Mark,
    MisplacedPictureFault,
    MissedPictureFault,
    Place,
    SensorFault,
    Share,
    marks_of,
)
from aeros.spec.declared.people import Person
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.types import FamilyType, RealType, VectorType
from aeros.spec.expr.units import LENGTH, TIME, Dimension
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import NumberField, TextField
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

_OPPORTUNITY_KEYS: Final = ("skill", "look", "every")


@dataclass(frozen=True, slots=True)
class FaultContext:
    """Names that a faults file may use.

    Attributes:
        quantities: state variables that the plant measures, by name; none of those that perceivers compute.
        skills: as `MODULE.SKILL`.
        things: objects of the scene that can be pushed.
        cameras: of the scene.
        scanners: safety laser scanners of the site.
        files: faults files of modules, by name.
        bodies: all bodies of the scene, fixed ones included.
    """

    quantities: Mapping[str, Declared]
    skills: Collection[str]
    things: Collection[str]
    cameras: Collection[str]
    scanners: Collection[str] = ()
    files: Mapping[str, Path] = field(default_factory=dict)
    bodies: Collection[str] = ()

    @property
    def measured(self) -> Collection[str]:
        """Names of quantities and cameras."""
        return (*self.quantities, *self.cameras)


def faults_in(folder: str | os.PathLike[str]) -> dict[str, Path]:
    """List the faults files of a module.

    Args:
        folder: the module's folder.

    Returns:
        Their paths by name, which is the file's without suffix.
    """
    return {path.stem: path for path in sorted((Path(folder) / "faults").glob("*.yaml"))}


def shipped_faults() -> dict[str, Path]:
    """List the faults files that come with AEROS.

    Returns:
        Their paths by name.
    """
    return shipped_files("faults")


def read_faults(name_or_path: str, context: FaultContext) -> tuple[Fault, ...]:
    """Read a faults file.

    Args:
        name_or_path: a path, or the name of a file of a module or of AEROS.
        context: names that the file may use.

    Returns:
        The faults, in the order of the file.

    Raises:
        UserError: there is no such file, or it has problems; it lists all of them.
    """
    path = find_file(name_or_path, {**context.files, **shipped_faults()}, "faults file")
    return parse_faults(read_source(path), context)


def parse_faults(source: Source, context: FaultContext) -> tuple[Fault, ...]:
    """Parse the text of a faults file.

    Args:
        source: the text and its path.
        context: names that it may use.

    Returns:
        The faults, in the order of the file.

    Raises:
        UserError: the text has problems; it lists all of them.
    """
    diagnostics = Diagnostics()
    node = read_yaml(source, diagnostics)
    file = None if node is None else decode(node, declared.Faults, diagnostics)
    faults = (
        []
        if file is None
        else [_fault(str(name), fault, context, diagnostics) for name, fault in file.faults]
    )
    diagnostics.raise_if_errors()
    return tuple(fault for fault in faults if fault is not None)


def _fault(
    name: str, declaration: declared.Fault, context: FaultContext, diagnostics: Diagnostics
) -> Fault | None:
    at = _opportunity(declaration.at, context, diagnostics)
    process = _process(declaration, diagnostics)
    word = _exactly_one(declaration, tuple(KINDS), declaration.key_span, f"`{name}`", diagnostics)
    kind = None if word is None else _kind(name, word, getattr(declaration, word), context, diagnostics)
    if at is None or process is None or word is None or kind is None:
        return None
    if isinstance(kind, MissedPictureFault | MisplacedPictureFault) is not isinstance(at, CameraOpportunity):
        allowed = (
            "`look`" if isinstance(kind, MissedPictureFault | MisplacedPictureFault) else "`skill` or `every`"
        )
        diagnostics.error(
            "AE208",
            f"`{word}` is only valid with {allowed}",
            declaration.at.span,
            help=("faults of pictures use `look`; physical faults use `skill` or `every`",),
        )
        return None
    return Fault(name, at, process, kind, None if declaration.at_most is None else declaration.at_most.value)


def _exactly_one(
    declaration: Any, names: tuple[str, ...], span: SourceSpan, what: str, diagnostics: Diagnostics
) -> str | None:
    """Return the name of the only field that is set; report if none is or several are."""
    present = [name for name in names if getattr(declaration, name) is not None]
    if len(present) == 1:
        return present[0]
    fields = " and ".join(f"`{name}`" for name in present) or "none"
    listed = ", ".join(f"`{name}`" for name in names)
    diagnostics.error("AE208", f"{what} needs exactly one of {listed}; it has {fields}", span)
    return None


# Opportunities.


def _opportunity(
    at: declared.FaultTrigger, context: FaultContext, diagnostics: Diagnostics
) -> Opportunity | None:
    word = _exactly_one(at, _OPPORTUNITY_KEYS, at.span, "`at`", diagnostics)
    if word is None:
        return None
    after = 0 if at.after is None else _ticks(at.after, diagnostics, least=0)
    waits = at.once or at.after
    if waits is not None and word != "skill":
        diagnostics.error("AE208", "`once` and `after` are only valid with `skill`", waits.span)
        return None
    if at.during is not None and word != "look":
        diagnostics.error("AE208", "`during` is only valid with `look`", at.during.span)
        return None
    if at.skill is not None:
        if not _is_known(at.skill, context.skills, "skill of a loaded module", diagnostics) or after is None:
            return None
        return SkillOpportunity(at.skill.value, after, at.once is not None)
    if at.look is not None:
        known = _is_known(at.look, context.cameras, "camera of the scene", diagnostics)
        if at.during is None:
            return CameraOpportunity(at.look.value) if known else None
        known = _is_known(at.during, context.skills, "skill of a loaded module", diagnostics) and known
        return CameraOpportunity(at.look.value, at.during.value) if known else None
    period = None if at.every is None else _ticks(at.every, diagnostics)
    return None if period is None else TimedOpportunity(period)


def _is_known(name: TextField, known: Collection[str], what: str, diagnostics: Diagnostics) -> bool:
    if name.value in known:
        return True
    near = did_you_mean(name.value, known)
    listed = ", ".join(f"`{candidate}`" for candidate in sorted(known)) or "there is none"
    help_ = (f"did you mean `{near}`?",) if near else (f"known: {listed}",)
    diagnostics.error("AE122", f"`{name.value}` is not a {what}", name.span, help=help_)
    return False


# Rates.


def _process(declaration: declared.Fault, diagnostics: Diagnostics) -> GilbertElliottProcess | None:
    rate, bursts = declaration.rate.value, declaration.bursts
    if bursts is None:
        return GilbertElliottProcess(0.0, 0.0, 1.0, 1.0, float(rate))
    within = Fraction(1) if bursts.within is None else bursts.within.value
    between = Fraction(0) if bursts.between is None else bursts.between.value
    length = bursts.mean_length.value
    if not between < rate < within:
        diagnostics.error(
            "AE208",
            f"rate {float(rate):g} is impossible with in-burst rate {float(within):g} "
            f"and base rate {float(between):g}",
            declaration.rate.span,
            help=("choose `between` below `rate` and `within` above it",),
        )
        return None
    least = min_mean_burst((rate - between) / (within - between))
    if length < least:
        diagnostics.error(
            "AE208",
            f"bursts of {float(length):g} are too short for this rate",
            bursts.mean_length.span,
            help=(f"a `mean_length` of at least {float(least):.4g} gives it",),
        )
        return None
    return GilbertElliottModel(rate, length, within, between).process()


# Effects.


def _kind(
    name: str, word: str, declaration: Any, context: FaultContext, diagnostics: Diagnostics
) -> PhysicalFault | PictureFault | None:
    if isinstance(declaration, Person):
        return PersonEntersFault(parse_person(name, declaration, diagnostics))
    kind, values = KINDS[word], dict[str, object]()
    for name_of_field, mark in marks_of(kind).items():
        written = getattr(declaration, name_of_field)
        if written is not None:
            values[name_of_field] = _value(mark, written, declaration, context, diagnostics)
        if name_of_field == "of" and written is not None and values["of"] is None:
            return None  # the other fields cannot be checked without it
    if kind is SensorFault and values.keys() == {"of", "lasts"}:
        diagnostics.error("AE208", "`misread` needs `noise`, `latency` or `dropout`", declaration.span)
        return None
    fault: PhysicalFault | PictureFault | None = None if None in values.values() else kind(**values)
    return fault


def _value(
    mark: Mark, written: Any, declaration: Any, context: FaultContext, diagnostics: Diagnostics
) -> object:
    """Return the value in SI of a field of `one`, by its mark; None where it is wrong, and reported."""
    match mark:
        case Known(among=among, noun=noun):
            return written.value if _is_known(written, getattr(context, among), noun, diagnostics) else None
        case Amount(dimension=dimension, most=most):
            return _quantity(written, dimension, most, diagnostics)
        case Deviation():
            return _deviation(written, declaration.of, context, diagnostics)
        case Duration():
            return _ticks(written, diagnostics)
        case Share():
            return float(written.value)
        case Direction():
            return _direction(written, diagnostics)
        case Place():
            return _lengths(written, -MAX_COORDINATE, MAX_COORDINATE, diagnostics)
        case Edges():
            return _lengths(written, LEAST_EDGE, MOST_EDGE, diagnostics)


def _deviation(
    text: TextField, of: TextField, context: FaultContext, diagnostics: Diagnostics
) -> float | None:
    """Return a standard deviation of the known quantity `of`, or of a camera; None where wrong."""
    if of.value in context.cameras:
        return _quantity(text, LENGTH, 1000, diagnostics)
    type_ = context.quantities[of.value].variable.type
    element = type_.element if isinstance(type_, FamilyType) else type_
    if isinstance(element, RealType | VectorType):
        return _quantity(text, element.dimension, 1000, diagnostics)
    diagnostics.error("AE208", f"`{of.value}` is not numeric, so it cannot have noise", text.span)
    return None


def _direction(numbers: tuple[NumberField, ...], diagnostics: Diagnostics) -> Vec3 | None:
    """Return the direction with length 1; None where it has none, which is reported."""
    x, y, z = (float(number.value) for number in numbers)
    length = hypot(x, y, z)
    if not 1e-6 < length < 1e6:
        diagnostics.error(
            "AE208", "the direction vector is zero or out of range", numbers[0].span.merge(numbers[-1].span)
        )
        return None
    return (x / length, y / length, z / length)


def _lengths(
    lengths: tuple[TextField, ...], least: float, most: float, diagnostics: Diagnostics
) -> Vec3 | None:
    """Return three lengths in m; None where one is wrong, which is reported."""
    x, y, z = (_quantity(one, LENGTH, most, diagnostics, least=least) for one in lengths)
    return None if x is None or y is None or z is None else (x, y, z)


def _ticks(text: TextField, diagnostics: Diagnostics, *, least: int = 1) -> int | None:
    """Convert a time to whole ticks, rounded; report if there are fewer than `least`."""
    time = _quantity(text, TIME, LONGEST, diagnostics)
    if time is None:
        return None
    ticks = round(time / TICK)
    if ticks >= least:
        return ticks
    diagnostics.error(
        "AE111", f"`{text.value}` is shorter than a control tick", text.span, help=("a tick is 1/240 s",)
    )
    return None


def _quantity(
    text: TextField, dimension: Dimension, most: float, diagnostics: Diagnostics, *, least: float = 0
) -> float | None:
    value = elaborate_quantity(text, dimension, diagnostics)
    if value is None:
        return None
    # A bound is the decimal number that it is written as: no double is 0.01, and 10 mm is inside of it.
    if Fraction(str(least)) <= value <= Fraction(str(most)):
        return float(value)
    help_ = (f"write a value from {least:g} to {most:g} {dimension}",)
    diagnostics.error("AE111", f"`{text.value}` is outside its bounds", text.span, help=help_)
    return None

"""Read a people file: check it, report every problem with its place, and convert units."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import dist
from pathlib import Path
from typing import Final

from aeros.sim.engine import people
from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.declared import people as declared
from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.units import LENGTH, TIME, Dimension
from aeros.spec.text.fields import TextField
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

_MAX_VALUE: Final = 10**6
"""Greatest number of metres or seconds in a people file; realistic values are at most a few thousand."""

_SPEED: Final = LENGTH * TIME**-1


def shipped_people() -> dict[str, Path]:
    """List the people files that come with AEROS.

    Returns:
        Their paths by name.
    """
    return shipped_files("people")


def read_people(name_or_path: str) -> tuple[people.Person, ...]:
    """Read a people file.

    Args:
        name_or_path: a path, or the name of a shipped file.

    Returns:
        The people, in the order of the file.

    Raises:
        UserError: there is no such file, or it has problems.
    """
    path = Path(find_file(name_or_path, shipped_people(), "people file"))
    diagnostics = Diagnostics()
    node = read_yaml(read_source(path), diagnostics)
    file = None if node is None else decode(node, declared.People, diagnostics)
    diagnostics.raise_if_errors()
    result = (
        []
        if file is None
        else [parse_person(name.value, declaration, diagnostics) for name, declaration in file.people]
    )
    diagnostics.raise_if_errors()
    return tuple(result)


def parse_person(name: str, declaration: declared.Person, diagnostics: Diagnostics) -> people.Person:
    """Convert a declared person; if `diagnostics` has errors afterwards, the result must not be used.

    Args:
        name: of the person.
        declaration: as decoded from the file.
        diagnostics: receives the diagnostics.

    Returns:
        The person, in SI.
    """
    height = _non_negative_quantity(declaration.height, LENGTH, diagnostics, people.DEFAULT_HEIGHT)
    radius = _non_negative_quantity(declaration.radius, LENGTH, diagnostics, people.DEFAULT_RADIUS)
    if not diagnostics.has_errors and not 0.0 < 2.0 * radius <= height <= 3.0:
        place = declaration.height or declaration.radius
        diagnostics.error(
            "AE208",
            f"implausible person: {height:g} m tall, {2.0 * radius:g} m wide",
            declaration.span if place is None else place.span,
            help=("`radius` is at most half of `height`, and that at most 3 m",),
        )
    path = tuple(_waypoint(number, at, diagnostics) for number, at in enumerate(declaration.path))
    if not diagnostics.has_errors:
        _check_times(path, declaration.path, diagnostics)
    floor = None if declaration.floor is None else _number(declaration.floor, LENGTH, diagnostics)
    spread, delay = (
        _non_negative_quantity(declaration.spread, LENGTH, diagnostics, 0.0),
        _non_negative_quantity(declaration.delay, TIME, diagnostics, 0.0),
    )
    return people.Person(name, path, height, radius, floor, spread, delay)


def _waypoint(number: int, declaration: declared.Waypoint, diagnostics: Diagnostics) -> people.Waypoint:
    x, y = (_number(part, LENGTH, diagnostics) for part in declaration.at)
    ways = [text for text in (declaration.speed, declaration.arrive) if text is not None]
    if number == 0 and ways:
        _report(
            "the first waypoint is the start: it has neither `speed` nor `arrive`", ways[0].span, diagnostics
        )
    if number > 0 and len(ways) != 1:
        _report("a further waypoint has either `speed` or `arrive`", declaration.span, diagnostics)
    speed = (
        None
        if declaration.speed is None
        else _non_negative_quantity(declaration.speed, _SPEED, diagnostics, 0.0)
    )
    if declaration.speed is not None and speed is not None and not 0.0 < speed <= people.MAX_SPEED:
        _report_speed(speed, declaration.speed.span, diagnostics)
    arrive = (
        None
        if declaration.arrive is None
        else _non_negative_quantity(declaration.arrive, TIME, diagnostics, 0.0)
    )
    return people.Waypoint(
        (x, y), speed, arrive, _non_negative_quantity(declaration.stay, TIME, diagnostics, 0.0)
    )


def _check_times(
    path: Sequence[people.Waypoint], places: Sequence[declared.Waypoint], diagnostics: Diagnostics
) -> None:
    """Report waypoints that nobody can reach in time."""
    time, here = path[0].dwell, path[0].position
    for at, place in zip(path[1:], places[1:], strict=True):
        way, here = dist(here, at.position), at.position
        if at.arrival_time is not None and at.arrival_time <= time:
            _report(
                f"`arrive` is before the previous waypoint is left, at {time:g} s", place.span, diagnostics
            )
        elif at.arrival_time is not None and way / (at.arrival_time - time) > people.MAX_SPEED:
            _report_speed(way / (at.arrival_time - time), place.span, diagnostics)
        time = (
            time + way / (at.speed or people.MAX_SPEED) if at.arrival_time is None else at.arrival_time
        ) + at.dwell


def _report_speed(speed: float, span: SourceSpan, diagnostics: Diagnostics) -> None:
    help_ = f"let them walk at more than 0 and at most {people.MAX_SPEED:g} m/s"
    _report(f"walking speed {speed:.4g} m/s is out of range", span, diagnostics, help_)


def _non_negative_quantity(
    text: TextField | None, dimension: Dimension, diagnostics: Diagnostics, default: float
) -> float:
    """Convert a quantity to SI; report a negative one."""
    if text is None:
        return default
    value = _number(text, dimension, diagnostics)
    if value < 0.0:
        _report(f"`{text.value}` is negative", text.span, diagnostics)
    return value


def _number(text: TextField, dimension: Dimension, diagnostics: Diagnostics) -> float:
    """Convert a quantity to SI; 0 if it has a problem, which is reported."""
    value = elaborate_quantity(text, dimension, diagnostics) or Fraction(0)
    if abs(value) <= _MAX_VALUE:
        return float(value)
    _report(f"`{text.value}` is larger than the limit of {_MAX_VALUE}", text.span, diagnostics)
    return 0.0


def _report(headline: str, span: SourceSpan, diagnostics: Diagnostics, *help_: str) -> None:
    diagnostics.error("AE208", headline, span, help=help_)

"""A people file → people, each fault reported at its place."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import dist
from pathlib import Path
from typing import Final

from aeros.sim.bullet import people
from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.declared import people as declared
from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Span
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.units import LENGTH, TIME, Dimension
from aeros.spec.text.fields import Text
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

_MOST: Final = 10**6
"""Metres and seconds up to which somebody can be declared; a few thousand have a meaning."""

_SPEED: Final = LENGTH * TIME**-1


def shipped_people() -> dict[str, Path]:
    """Return the people files that come with AEROS, by name."""
    return shipped_files("people")


def read_people(name_or_path: str) -> tuple[people.Person, ...]:
    """Those of a file, or of a shipped one by its name.  Raises UserError, which says what is wrong."""
    path = Path(find_file(name_or_path, shipped_people(), "people file", "nobody of that name comes"))
    sink = Diagnostics()
    node = read_yaml(read_source(path), sink)
    found = None if node is None else decode(node, declared.People, sink)
    sink.raise_if_errors()
    everybody = [] if found is None else [person_of(name.value, one, sink) for name, one in found.people]
    sink.raise_if_errors()
    return tuple(everybody)


def person_of(name: str, one: declared.Person, sink: Diagnostics) -> people.Person:
    """Somebody as declared; wrong, and reported, where `sink` has errors afterwards."""
    height = _amount(one.height, LENGTH, sink, people.HEIGHT)
    radius = _amount(one.radius, LENGTH, sink, people.RADIUS)
    if not sink.has_errors and not 0.0 < 2.0 * radius <= height <= 3.0:
        place = one.height or one.radius
        sink.error(
            "AE208",
            f"nobody is {height:g} m tall and {2.0 * radius:g} m wide",
            one.span if place is None else place.span,
            help=("`radius` is at most half of `height`, and that at most 3 m",),
        )
    path = tuple(_waypoint(number, at, sink) for number, at in enumerate(one.path))
    if not sink.has_errors:
        _check_times(path, one.path, sink)
    floor = 0.0 if one.floor is None else _number(one.floor, LENGTH, sink)
    spread, delay = _amount(one.spread, LENGTH, sink, 0.0), _amount(one.delay, TIME, sink, 0.0)
    return people.Person(name, path, height, radius, floor, spread, delay)


def _waypoint(number: int, one: declared.Waypoint, sink: Diagnostics) -> people.Waypoint:
    x, y = (_number(part, LENGTH, sink) for part in one.at)
    ways = [text for text in (one.speed, one.arrive) if text is not None]
    if number == 0 and ways:
        _wrong("the first place is where they are; nobody has to walk there", ways[0].span, sink)
    if number > 0 and len(ways) != 1:
        _wrong("a further place has either `speed` or `arrive`", one.span, sink)
    speed = None if one.speed is None else _amount(one.speed, _SPEED, sink, 0.0)
    if one.speed is not None and speed is not None and not 0.0 < speed <= people.FASTEST:
        _nobody_walks(speed, one.speed.span, sink)
    arrive = None if one.arrive is None else _amount(one.arrive, TIME, sink, 0.0)
    return people.Waypoint((x, y), speed, arrive, _amount(one.stay, TIME, sink, 0.0))


def _check_times(
    path: Sequence[people.Waypoint], places: Sequence[declared.Waypoint], sink: Diagnostics
) -> None:
    """Report places that nobody can reach when they are to."""
    time, here = path[0].stay, path[0].at
    for at, place in zip(path[1:], places[1:], strict=True):
        way, here = dist(here, at.at), at.at
        if at.arrive is not None and at.arrive <= time:
            _wrong(f"they are still at the place before then: until {time:g} s", place.span, sink)
        elif at.arrive is not None and way / (at.arrive - time) > people.FASTEST:
            _nobody_walks(way / (at.arrive - time), place.span, sink)
        time = (time + way / (at.speed or people.FASTEST) if at.arrive is None else at.arrive) + at.stay


def _nobody_walks(speed: float, span: Span, sink: Diagnostics) -> None:
    help_ = f"let them walk at more than 0 and at most {people.FASTEST:g} m/s"
    _wrong(f"nobody walks at {speed:.4g} m/s", span, sink, help_)


def _amount(text: Text | None, dimension: Dimension, sink: Diagnostics, default: float) -> float:
    """A quantity that is not negative, in SI."""
    if text is None:
        return default
    value = _number(text, dimension, sink)
    if value < 0.0:
        _wrong(f"`{text.value}` is negative", text.span, sink)
    return value


def _number(text: Text, dimension: Dimension, sink: Diagnostics) -> float:
    """A quantity in SI; 0 where something is wrong with it, which is reported."""
    value = elaborate_quantity(text, dimension, sink) or Fraction(0)
    if abs(value) <= _MOST:
        return float(value)
    _wrong(f"`{text.value}` is beyond every cell and every run", text.span, sink)
    return 0.0


def _wrong(headline: str, span: Span, sink: Diagnostics, *help_: str) -> None:
    sink.error("AE208", headline, span, help=help_)

"""Schema of a people file, unresolved: who walks where while a robot works in simulation.

Lengths and times are still text; `aeros.sim.bullet.people_file` gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.site import Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import LengthBounds, TextField


@dataclass(frozen=True)
class Waypoint:
    """One place on somebody's way: reached at a speed or by a time, and stayed at."""

    span: SourceSpan
    at: Annotated[tuple[TextField, ...], LengthBounds(2, 2)] = field(
        metadata={"doc": "x and y in W", "example": "[1.5 m, 0.4 m]"}
    )
    speed: TextField | None = field(
        default=None, metadata={"doc": "how fast they walk there, as in `speed: 1.2 m/s`"}
    )
    arrive: TextField | None = field(
        default=None,
        metadata={"doc": "when they are there instead, on the plant's clock, as in `arrive: 8 s`"},
    )
    stay: TextField | None = field(
        default=None, metadata={"doc": "how long they stand there, as in `stay: 5 s`; the last stay for good"}
    )


@dataclass(frozen=True)
class Person:
    """An upright person, as the capsule that encloses them, and their way."""

    span: SourceSpan
    path: Annotated[tuple[Waypoint, ...], LengthBounds(1, 1000)] = field(
        metadata={"doc": "where they are at first, and where they walk from there in straight lines"}
    )
    height: TextField | None = field(default=None, metadata={"doc": "how tall they are; 1.75 m if absent"})
    radius: TextField | None = field(default=None, metadata={"doc": "half their width; 250 mm if absent"})
    floor: TextField | None = field(
        default=None, metadata={"doc": "height in W of what they stand on; 0 m if absent"}
    )
    spread: TextField | None = field(
        default=None,
        metadata={"doc": "how far each place may be from where it is declared, in x and in y, by the seed"},
    )
    delay: TextField | None = field(
        default=None, metadata={"doc": "how much longer they may stay at the first place, by the seed"}
    )


@dataclass(frozen=True)
class People:
    """A whole people file."""

    span: SourceSpan
    schema: Literal["aeros/people/1"] = field(metadata={"doc": "`schema: aeros/people/1`"})
    description: TextField = field(metadata={"doc": "what happens, for people"})
    people: Annotated[Named[Person], LengthBounds(1, 100)] = field(metadata={"doc": "who is there, by name"})

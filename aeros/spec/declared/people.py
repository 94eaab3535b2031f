"""Schema of a people file, unresolved: who walks where while a robot works in simulation.

Lengths and times are still text; `aeros.sim.engine.people_file` gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import LengthBounds, TextField


@dataclass(frozen=True)
class Waypoint:
    """One place on a person's path, reached at a speed or at a given time.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Annotated[tuple[TextField, ...], LengthBounds(2, 2)] = field(
        metadata={"doc": "x and y in W", "example": "[1.5 m, 0.4 m]"}
    )
    speed: TextField | None = field(
        default=None, metadata={"doc": "walking speed to this place, as in `speed: 1.2 m/s`"}
    )
    arrive: TextField | None = field(
        default=None,
        metadata={"doc": "instead of `speed`: time of arrival on the plant's clock, as in `arrive: 8 s`"},
    )
    stay: TextField | None = field(
        default=None, metadata={"doc": "time spent there, as in `stay: 5 s`; unlimited at the last place"}
    )


@dataclass(frozen=True)
class Person:
    """An upright person, modelled as a capsule, and their path.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    path: Annotated[tuple[Waypoint, ...], LengthBounds(1, 1000)] = field(
        metadata={"doc": "the start, then the places to walk to in straight lines"}
    )
    height: TextField | None = field(default=None, metadata={"doc": "their height; 1.75 m if absent"})
    radius: TextField | None = field(default=None, metadata={"doc": "half their width; 250 mm if absent"})
    floor: TextField | None = field(
        default=None,
        metadata={
            "doc": "height in W of the floor under them; that of the cell's scanners if absent, or 0 m"
        },
    )
    spread: TextField | None = field(
        default=None,
        metadata={"doc": "greatest random offset of each place in x and in y, drawn by the seed"},
    )
    delay: TextField | None = field(
        default=None, metadata={"doc": "greatest random delay at the first place, drawn by the seed"}
    )


@dataclass(frozen=True)
class People:
    """A whole people file.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/people/1"] = field(metadata={"doc": "`schema: aeros/people/1`"})
    description: TextField = field(metadata={"doc": "the scenario, for readers of the file"})
    people: Annotated[Named[Person], LengthBounds(1, 100)] = field(metadata={"doc": "the people, by name"})

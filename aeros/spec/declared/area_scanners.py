"""Schema of the safety laser scanners of a cell; units are still text."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from aeros.spec.declared.field_types import Identifier, Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import LengthBounds, MappingField, NumberField, TextField


@dataclass(frozen=True)
class ScannerPlacement:
    """A scanner in its place.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Annotated[tuple[TextField, ...], LengthBounds(2, 2)] = field(
        metadata={"doc": "x and y in W", "example": "[-1.6 m, -2.5 m]"}
    )
    facing: TextField = field(
        metadata={"doc": "middle of its field of view, from the x axis of W, as in `facing: 45 deg`"}
    )


@dataclass(frozen=True)
class AreaScanners:
    """Scanners of one type that together measure how far people are from the robot, in one level plane.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    measures: Identifier = field(
        metadata={"doc": "the state variable that they measure, a distance, as in `measures: human_distance`"}
    )
    source: TextField = field(metadata={"doc": "data sheet of the type, and what of the rest is chosen"})
    floor: TextField = field(metadata={"doc": "height in W of the floor, as in `floor: -300 mm`"})
    height: TextField = field(metadata={"doc": "of the plane above the floor, as in `height: 200 mm`"})
    field_of_view: TextField = field(metadata={"doc": "of each scanner, as in `field_of_view: 275 deg`"})
    resolution: TextField = field(metadata={"doc": "angle between two rays, as in `resolution: 0.5 deg`"})
    range: TextField = field(metadata={"doc": "the farthest distance that is seen, as in `range: 5.5 m`"})
    period: TextField = field(metadata={"doc": "time from scan to scan, as in `period: 30 ms`"})
    latency: TextField = field(
        metadata={"doc": "time from the beginning of a scan to its result, as in `latency: 35 ms`"}
    )
    noise: TextField = field(
        metadata={"doc": "standard deviation of a measured distance, as in `noise: 20 mm`"}
    )
    allowance: TextField = field(
        metadata={"doc": "the greatest error of a measured distance, as in `allowance: 100 mm`"}
    )
    scanners: Named[ScannerPlacement] = field(
        default=MappingField(), metadata={"doc": "where they are, by name"}
    )
    dropout: NumberField | None = field(
        default=None, metadata={"doc": "probability that a scan is lost, as in `dropout: 0.0001`"}
    )

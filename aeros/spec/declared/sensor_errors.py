"""Schema of the errors of a site's sensors, and of its safety laser scanners; units are still text."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from aeros.spec.declared.field_types import Identifier, Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import LengthBounds, MappingField, NumberField, TextField


@dataclass(frozen=True)
class QuantityErrors:
    """Errors of what a sensor measures; a field that is absent means none of that kind.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    source: TextField = field(metadata={"doc": "a data sheet, a measurement, or `chosen`"})
    noise: TextField | None = field(
        default=None, metadata={"doc": "standard deviation of each number, as in `noise: 0.1 N`"}
    )
    bias: TextField | None = field(
        default=None,
        metadata={"doc": "standard deviation of each number's constant error, drawn once for a run"},
    )
    resolution: TextField | None = field(
        default=None, metadata={"doc": "readings are whole multiples of it, as in `resolution: 0.1 mm`"}
    )
    latency: TextField | None = field(
        default=None, metadata={"doc": "time until a value's reading arrives, as in `latency: 8 ms`"}
    )
    dropout: NumberField | None = field(
        default=None,
        metadata={"doc": "probability that a tick's value is never read, as in `dropout: 0.001`"},
    )


@dataclass(frozen=True)
class CameraErrors:
    """Errors of the pictures of a camera.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    source: TextField = field(metadata={"doc": "a data sheet, a measurement, or `chosen`"})
    colour_noise: NumberField | None = field(
        default=None,
        metadata={"doc": "standard deviation of each colour of a pixel, of 255, as in `colour_noise: 2`"},
    )
    depth_noise: TextField | None = field(
        default=None, metadata={"doc": "standard deviation of a pixel's depth, as in `depth_noise: 1 mm`"}
    )
    latency: TextField | None = field(
        default=None, metadata={"doc": "time until a picture arrives after its read-out"}
    )
    dropout: NumberField | None = field(
        default=None, metadata={"doc": "probability that a picture is lost, as in `dropout: 0.002`"}
    )


@dataclass(frozen=True)
class SurveyErrors:
    """Errors of surveyed places.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    source: TextField = field(metadata={"doc": "a data sheet, a measurement, or `chosen`"})
    setup: TextField = field(
        metadata={"doc": "standard deviation of each coordinate of a survey at setup, as in `setup: 2 mm`"}
    )
    calibration: TextField = field(
        metadata={"doc": "the same by a camera's own error, drawn once for a run, at a distance of 1 m"}
    )
    noise: TextField = field(metadata={"doc": "the same of a detected marker, at a distance of 1 m"})


@dataclass(frozen=True)
class OdometryErrors:
    """Errors of wheel odometry.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    source: TextField = field(metadata={"doc": "a data sheet, a measurement, or `chosen`"})
    scale: NumberField = field(
        metadata={"doc": "standard deviation of an axis' scale error, as in `scale: 0.005`"}
    )
    drift: TextField = field(
        metadata={"doc": "standard deviation of the drift after one metre, as in `drift: 4 mm`"}
    )


@dataclass(frozen=True)
class SensorErrors:
    """Errors that simulated plants give the site's sensors, unless a run asks for ideal ones.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    state: Named[QuantityErrors] = field(
        default=MappingField(), metadata={"doc": "of the site's state variables, by name"}
    )
    sensors: Named[QuantityErrors] = field(
        default=MappingField(),
        metadata={
            "doc": "of sensors that modules read, by name: of those of their variables that have the unit"
        },
    )
    cameras: Named[CameraErrors] = field(
        default=MappingField(), metadata={"doc": "of the pictures of cameras, by name"}
    )
    survey: SurveyErrors | None = field(default=None, metadata={"doc": "of surveyed places"})
    odometry: OdometryErrors | None = field(default=None, metadata={"doc": "of a base that drives"})


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

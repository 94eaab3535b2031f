"""Schema of the errors of a site's sensors, for simulated plants; units are still text."""

from __future__ import annotations

from dataclasses import dataclass, field

from aeros.spec.declared.field_types import Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import MappingField, NumberField, TextField


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

"""Errors of a site's sensors, and its safety laser scanners, for simulated plants. SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from aeros.spec.expr.units import Dimension


class QuantityErrors(NamedTuple):
    """Errors of what a sensor measures.

    Attributes:
        dimension: of noise, bias and resolution; None if there are none of these.
        noise: standard deviation of each number.
        bias: standard deviation of each number's constant error.
        resolution: readings are whole multiples of it; 0 means no rounding.
        latency: time until a value's reading arrives, s.
        dropout: probability that the value of a tick is never read.
    """

    dimension: Dimension | None = None
    noise: float = 0.0
    bias: float = 0.0
    resolution: float = 0.0
    latency: float = 0.0
    dropout: float = 0.0


class CameraErrors(NamedTuple):
    """Errors of the pictures of a camera.

    Attributes:
        colour_noise: standard deviation of each colour of a pixel, of 255.
        depth_noise: standard deviation of a pixel's depth, m.
        latency: time until a picture arrives, s.
        dropout: probability that a picture is lost.
    """

    colour_noise: float = 0.0
    depth_noise: float = 0.0
    latency: float = 0.0
    dropout: float = 0.0


class SurveyErrors(NamedTuple):
    """Errors of surveyed places; by default none.

    Attributes:
        setup: standard deviation of each coordinate of a place that was surveyed at setup, m.
        calibration: standard deviation of each coordinate by a camera's own error, at a distance of 1 m; it
            grows with the distance, m.
        noise: standard deviation of each coordinate of a detection, at a distance of 1 m; it grows with the
            square of the distance, m.
    """

    setup: float = 0.0
    calibration: float = 0.0
    noise: float = 0.0


class OdometryErrors(NamedTuple):
    """Errors of wheel odometry; by default none.

    Attributes:
        scale: standard deviation of the scale error of an axis.
        drift: standard deviation of the drift after one metre, m.
    """

    scale: float = 0.0
    drift: float = 0.0


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """Errors of all sensors of a site; by default none.

    Attributes:
        state: of its state variables, by name.
        sensors: of sensors that modules read, by name.
        cameras: of its cameras, by name.
        survey: of surveyed places.
        odometry: of a base that drives.
    """

    state: Mapping[str, QuantityErrors] = field(default_factory=dict)
    sensors: Mapping[str, QuantityErrors] = field(default_factory=dict)
    cameras: Mapping[str, CameraErrors] = field(default_factory=dict)
    survey: SurveyErrors = field(default_factory=SurveyErrors)
    odometry: OdometryErrors = field(default_factory=OdometryErrors)


# Safety laser scanners; positions in W.


class ScannerPlacement(NamedTuple):
    """A scanner in its place.

    Attributes:
        name: its name.
        x: position in W, m.
        y: position in W, m.
        facing: direction of the middle of its field of view, from the x axis of W, rad.
    """

    name: str
    x: float
    y: float
    facing: float


class AreaScanners(NamedTuple):
    """Scanners of one type that together measure the distance of people; all scan in one level plane.

    Attributes:
        measures: state variable that they measure.
        floor: height in W of the floor that people stand on, m.
        height: of the plane above that floor, m.
        field_of_view: angle that each scanner sees, rad.
        step: angle between two rays, rad.
        range: farthest distance that each scanner sees, m.
        period: time from one scan to the next, s.
        latency: time from the beginning of a scan until its result arrives, s.
        noise: standard deviation of a measured distance, m.
        allowance: greatest error of a measured distance, m.
        dropout: probability that a scan is lost, for each scanner.
        scanners: where they are.
    """

    measures: str
    floor: float
    height: float
    field_of_view: float
    step: float
    range: float
    period: float
    latency: float
    noise: float
    allowance: float
    dropout: float
    scanners: tuple[ScannerPlacement, ...]

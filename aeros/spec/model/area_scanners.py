"""The safety laser scanners of a cell. SI units; positions in W."""

from __future__ import annotations

from typing import NamedTuple


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

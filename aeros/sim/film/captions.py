"""Captions of a film: the decision in force, measured values with their bounds, and marks in space."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal, NamedTuple

from aeros.sim.geometry import Vector3

Status = Literal[
    "allowed", "slowed", "denied", "stopped", "waiting", "paused", "reached", "failed", "idle", "unchecked"
]
"""What the robot does, and the verdict of the gate that it follows from."""

STATUS_TEXTS: Final[dict[Status, str]] = {
    "allowed": "ALLOWED",
    "slowed": "SLOWED DOWN",
    "denied": "DENIED",
    "stopped": "STOPPED",
    "waiting": "WAITING",
    "paused": "PAUSED",
    "reached": "GOAL REACHED",
    "failed": "TASK FAILED",
    "idle": "THINKING",
    "unchecked": "NO GATE",
}


class Gauge(NamedTuple):
    """A measured value against its bound.

    Attributes:
        label: for people.
        value: the measured value, in `unit`; None if it is not measured.
        bound: the bound in force; None if there is none.
        is_upper: True if the value must be at most the bound, False if at least.
        unit: unit of both.
        full: value at the end of the scale.
    """

    label: str
    value: float | None
    bound: float | None
    is_upper: bool
    unit: str
    full: float


class PersonSeparation(NamedTuple):
    """Distances that people must keep.

    Attributes:
        measured: distance of the nearest person as measured, m; None if it is not known.
        stop: distance below which the robot stops, m.
        slow: distance below which it moves slowly, m; None if there is none.
    """

    measured: float | None
    stop: float
    slow: float | None


class ZoneFigure(NamedTuple):
    """A volume of the site.

    Attributes:
        name: its name.
        low: lowest corner in W, m.
        high: highest corner in W, m.
        is_broken: True if the latest decision was that something must not be in it, or not outside of it.
    """

    name: str
    low: Vector3
    high: Vector3
    is_broken: bool


class Detection(NamedTuple):
    """A thing that the robot takes to be somewhere.

    Attributes:
        label: for people.
        position: in W, m.
    """

    label: str
    position: Vector3


class Caption(NamedTuple):
    """Texts, values and marks of one time.

    Attributes:
        status: status of the robot.
        headline: the reason in one sentence; may be empty.
        rule: the rules that bit, with the place of their source; may be empty.
        skill: the skill, as `MODULE.SKILL`; may be empty.
        action: the action with its parameters; may be empty.
        since: time at which the status began, s.
        gauges: measured values.
        separation: distances that people must keep; None if no rule bounds them.
        joint_path: joint positions along the decided path, rad; empty if nothing moves.
        zones: volumes of the site.
        camera: name of the camera that took the latest picture; empty if none did.
        pictured_at: time of that picture, s.
        detections: things whose places the robot knows.
    """

    status: Status = "idle"
    headline: str = ""
    rule: str = ""
    skill: str = ""
    action: str = ""
    since: float = 0.0
    gauges: tuple[Gauge, ...] = ()
    separation: PersonSeparation | None = None
    joint_path: tuple[tuple[float, ...], ...] = ()
    zones: tuple[ZoneFigure, ...] = ()
    camera: str = ""
    pictured_at: float = 0.0
    detections: tuple[Detection, ...] = ()


CaptionSource = Callable[[float], Caption]
"""Returns the caption at a simulated time, s."""

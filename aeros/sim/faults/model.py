"""Faults as the injector needs them: names resolved, quantities in SI, durations in ticks."""

from __future__ import annotations

from dataclasses import dataclass

from aeros.sim.bullet.people import Person
from aeros.sim.gilbert_elliott import GilbertElliottProcess
from aeros.spec.declared.faults import (
    CommandDelayFault,
    DisplacedDetectionFault,
    GripForceFault,
    ImpulseFault,
    MissedDetectionFault,
    PadFrictionFault,
    SensorFault,
    TorqueFault,
)


@dataclass(frozen=True, slots=True)
class SkillOpportunity:
    """Each invocation of `skill`; begins `delay_ticks` ticks in, counted from the first hold if `from_first_grip`.

    An invocation that ends before that lets the fault pass.
    """

    skill: str
    delay_ticks: int
    from_first_grip: bool


@dataclass(frozen=True, slots=True)
class CameraOpportunity:
    """Each picture that `camera` takes; where `while_skill` names a skill, while that is under way."""

    camera: str
    while_skill: str | None = None


@dataclass(frozen=True, slots=True)
class TimedOpportunity:
    """The end of each `period_ticks` ticks of the plant's clock."""

    period_ticks: int


Opportunity = SkillOpportunity | CameraOpportunity | TimedOpportunity
"""What a fault's rate is per."""


@dataclass(frozen=True, slots=True)
class PersonEntersFault:
    """Somebody comes, and goes their way."""

    person: Person


PhysicalFault = (
    ImpulseFault
    | PadFrictionFault
    | GripForceFault
    | TorqueFault
    | CommandDelayFault
    | SensorFault
    | PersonEntersFault
)
"""What acts on bodies, motors and sensors, tick by tick."""

DetectionFault = MissedDetectionFault | DisplacedDetectionFault
"""What acts on a picture's evaluation."""


@dataclass(frozen=True, slots=True)
class Fault:
    """When it can happen, how often it does, and what happens; what is seen goes with looks alone.

    at_most: after so many times in one run no further opportunity is taken.
    """

    name: str
    opportunity: Opportunity
    process: GilbertElliottProcess
    kind: PhysicalFault | DetectionFault
    max_count: int | None = None

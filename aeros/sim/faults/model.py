"""Faults as the injector needs them: names resolved, quantities in SI, durations in ticks."""

from __future__ import annotations

from dataclasses import dataclass

from aeros.sim.engine.people import Person
from aeros.sim.gilbert_elliott import GilbertElliottProcess
from aeros.spec.declared.faults import (
    BoxFault,
    CarryFault,
    CommandDelayFault,
    CoveredScannerFault,
    GripForceFault,
    ImpulseFault,
    MisplacedPictureFault,
    MissedPictureFault,
    PadFrictionFault,
    SensorFault,
    SilentScannerFault,
    TorqueFault,
)


@dataclass(frozen=True, slots=True)
class SkillOpportunity:
    """An opportunity at each invocation of a skill.

    An invocation that ends before the fault begins lets the opportunity pass.

    Attributes:
        skill: as `MODULE.SKILL`.
        delay_ticks: ticks from the start of the invocation to the beginning of the fault.
        from_first_grip: count the delay from when the robot first holds something instead.
    """

    skill: str
    delay_ticks: int
    from_first_grip: bool


@dataclass(frozen=True, slots=True)
class CameraOpportunity:
    """An opportunity at each picture that a camera takes, or at those taken during a skill.

    Attributes:
        camera: its name.
        while_skill: only pictures while this skill is under way, as `MODULE.SKILL`; None for all.
    """

    camera: str
    while_skill: str | None = None


@dataclass(frozen=True, slots=True)
class TimedOpportunity:
    """An opportunity at regular times of the plant's clock.

    Attributes:
        period_ticks: number of ticks between two opportunities.
    """

    period_ticks: int


Opportunity = SkillOpportunity | CameraOpportunity | TimedOpportunity
"""Events at which a fault may happen."""


@dataclass(frozen=True, slots=True)
class PersonEntersFault:
    """A person who enters the scene and walks their path.

    Attributes:
        person: the person, with their path.
    """

    person: Person


PhysicalFault = (
    ImpulseFault
    | CarryFault
    | BoxFault
    | PadFrictionFault
    | GripForceFault
    | TorqueFault
    | CommandDelayFault
    | SensorFault
    | CoveredScannerFault
    | SilentScannerFault
    | PersonEntersFault
)
"""Faults of bodies, motors and sensors, which act tick by tick."""

PictureFault = MissedPictureFault | MisplacedPictureFault
"""Faults of cameras, which act on single pictures."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault: its opportunities, how often one is taken, and its effect.

    A picture fault has a `CameraOpportunity`, and only a picture fault has one.

    Attributes:
        name: unique in its file.
        opportunity: moments at which it may happen.
        process: random process that takes or leaves each opportunity.
        kind: the effect.
        max_count: greatest number of occurrences in one run; None for no limit.
    """

    name: str
    opportunity: Opportunity
    process: GilbertElliottProcess
    kind: PhysicalFault | PictureFault
    max_count: int | None = None

"""Faults as the injector needs them: names resolved, quantities in SI, durations in ticks."""

from __future__ import annotations

from dataclasses import dataclass

from aeros.sim.bullet.people import Person
from aeros.sim.gilbert_elliott import Process
from aeros.spec.declared.faults import Bump, Delay, Loosen, Misplace, Misread, Miss, Slip, Weaken


@dataclass(frozen=True, slots=True)
class OnSkill:
    """Each invocation of `skill`; begins `after` ticks in, counted from the first hold if `once_holding`.

    An invocation that ends before that lets the fault pass.
    """

    skill: str
    after: int
    once_holding: bool


@dataclass(frozen=True, slots=True)
class OnLook:
    """Each picture that `camera` takes; where `during` names a skill, while that is under way."""

    camera: str
    during: str | None = None


@dataclass(frozen=True, slots=True)
class OnTime:
    """The end of each `period` ticks of the plant's clock."""

    period: int


Opportunity = OnSkill | OnLook | OnTime
"""What a fault's rate is per."""


@dataclass(frozen=True, slots=True)
class Enter:
    """Somebody comes, and goes their way."""

    person: Person


Acting = Bump | Slip | Loosen | Weaken | Delay | Misread | Enter
"""What acts on bodies, motors and sensors, tick by tick."""

Seen = Miss | Misplace
"""What acts on a picture's evaluation."""


@dataclass(frozen=True, slots=True)
class Fault:
    """When it can happen, how often it does, and what happens; what is seen goes with looks alone.

    at_most: after so many times in one run no further opportunity is taken.
    """

    name: str
    opportunity: Opportunity
    process: Process
    kind: Acting | Seen
    at_most: int | None = None

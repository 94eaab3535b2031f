"""What each kind of fault does: tick by tick, or to what is made of a picture.

A fault that acts is an iterator, like a motion: each tick it pushes a body or says what it does to the
robot's parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import repeat
from math import cos, pi, sin

from numpy.random import Generator

from aeros.sim.clock import TICK
from aeros.sim.faults.degradation import NO_DEGRADATION, Degradation
from aeros.sim.faults.model import DetectionFault, PersonEntersFault, PhysicalFault
from aeros.sim.geometry import Vector3, add
from aeros.sim.physics import PlantParts
from aeros.sim.scenes.scene import DetectionFilter
from aeros.sim.sensors import SensorModel
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


def physical_effect(
    kind: PhysicalFault, source: Generator, name: str, stage: PlantParts
) -> Iterator[Degradation]:
    """The fault, one item a tick.  `name`: of the fault, this time."""
    match kind:
        case ImpulseFault():
            return _bump(kind, source, stage)
        case PadFrictionFault(friction, lasts):
            return repeat(Degradation(friction=friction), lasts)
        case GripForceFault(force, lasts):
            return repeat(Degradation(force=force), lasts)
        case TorqueFault(torque, lasts):
            return repeat(Degradation(torque_share=torque), lasts)
        case CommandDelayFault(by, lasts):
            return repeat(Degradation(lag_ticks=by), lasts)
        case SensorFault(of, lasts, noise, latency, dropout):
            model = SensorModel(noise=noise, latency=latency, dropout=dropout)
            return repeat(Degradation(sensors={of: model}), lasts)
        case PersonEntersFault(person):
            stage.people.add_person(replace(person, name=name))
            return iter(())


def _bump(bump: ImpulseFault, source: Generator, stage: PlantParts) -> Iterator[Degradation]:
    way = _random_horizontal(source) if bump.direction is None else bump.direction
    force = bump.impulse / (bump.over * TICK)
    body = stage.scene.body(bump.thing)
    for _ in range(bump.over):
        stage.world.push(body, (force * way[0], force * way[1], force * way[2]))
        yield NO_DEGRADATION


def detection_effect(kind: DetectionFault, source: Generator) -> DetectionFilter:
    """What comes of everything in one picture: nothing is shown, or all of it seems elsewhere alike."""
    match kind:
        case DisplacedDetectionFault(by, direction):
            x, y, z = _random_horizontal(source) if direction is None else direction
            return lambda found: (
                found and found._replace(position=add(found.position, (by * x, by * y, by * z)))
            )
        case MissedDetectionFault():
            return lambda _: None


def _random_horizontal(source: Generator) -> Vector3:
    """A level direction, any."""
    angle = float(source.uniform(-pi, pi))
    return (cos(angle), sin(angle), 0.0)

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
from aeros.sim.faults.degradation import UNHINDERED, Hindrance
from aeros.sim.faults.model import Acting, Enter, Seen
from aeros.sim.geometry import Triple, plus
from aeros.sim.physics import PlantParts
from aeros.sim.scenes.scene import Through
from aeros.sim.sensors import SensorModel
from aeros.spec.declared.faults import Bump, Delay, Loosen, Misplace, Misread, Miss, Slip, Weaken


def acting(kind: Acting, source: Generator, name: str, stage: PlantParts) -> Iterator[Hindrance]:
    """The fault, one item a tick.  `name`: of the fault, this time."""
    match kind:
        case Bump():
            return _bump(kind, source, stage)
        case Slip(friction, lasts):
            return repeat(Hindrance(friction=friction), lasts)
        case Loosen(force, lasts):
            return repeat(Hindrance(force=force), lasts)
        case Weaken(torque, lasts):
            return repeat(Hindrance(strength=torque), lasts)
        case Delay(by, lasts):
            return repeat(Hindrance(lag=by), lasts)
        case Misread(of, lasts, noise, latency, dropout):
            model = SensorModel(noise=noise, latency=latency, dropout=dropout)
            return repeat(Hindrance(sensors={of: model}), lasts)
        case Enter(person):
            stage.people.enter(replace(person, name=name))
            return iter(())


def _bump(bump: Bump, source: Generator, stage: PlantParts) -> Iterator[Hindrance]:
    way = _level(source) if bump.direction is None else bump.direction
    force = bump.impulse / (bump.over * TICK)
    body = stage.scene.thing(bump.thing)
    for _ in range(bump.over):
        stage.world.push(body, (force * way[0], force * way[1], force * way[2]))
        yield UNHINDERED


def seen(kind: Seen, source: Generator) -> Through:
    """What comes of everything in one picture: nothing is shown, or all of it seems elsewhere alike."""
    match kind:
        case Misplace(by, direction):
            x, y, z = _level(source) if direction is None else direction
            return lambda found: found and found._replace(place=plus(found.place, (by * x, by * y, by * z)))
        case Miss():
            return lambda _: None


def _level(source: Generator) -> Triple:
    """A level direction, any."""
    angle = float(source.uniform(-pi, pi))
    return (cos(angle), sin(angle), 0.0)

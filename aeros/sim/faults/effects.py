"""Effects of each kind of fault: physical effects tick by tick, and disturbances of pictures.

A physical effect is an iterator, like a motion: each tick it pushes a body or yields a degradation of the
robot's parts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import repeat
from math import cos, pi, sin
from typing import Final

import numpy as np
from numpy.random import Generator

from aeros.runtime.ports import CameraPicture
from aeros.sim.clock import TICK
from aeros.sim.engine.carried_way import LIFT, MAX_FORCE
from aeros.sim.engine.world import GRAVITY
from aeros.sim.faults.degradation import NO_DEGRADATION, Degradation
from aeros.sim.faults.model import PersonEntersFault, PhysicalFault, PictureFault
from aeros.sim.geometry import Pose, Vector3, add, subtract, to_world
from aeros.sim.physics import PlantParts
from aeros.sim.sensor_model import SensorModel
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

PictureEffect = Callable[[CameraPicture], CameraPicture]
"""Changes a picture."""

_BROUGHT_FROM: Final = 0.8
"""Height above its place at which somebody holds a box before they set it down, m: over the drawn-in arm."""

_STRENGTH_BY_WEIGHT: Final = 2.0
"""Greatest force of that hand over the weight of the box."""

_BOX_COLOUR: Final = (0.5, 0.4, 0.6, 1.0)
"""Colour of such a box, which no object of a task has."""

_FAR: Final = 5.0
"""Depth of a pixel that shows nothing near, m."""


def physical_effect(
    kind: PhysicalFault, source: Generator, name: str, parts: PlantParts
) -> Iterator[Degradation]:
    """Make the effect of a physical fault.

    Args:
        kind: the fault.
        source: random numbers of this occurrence.
        name: of this occurrence; a person who enters gets it.
        parts: the parts of the plant.

    Returns:
        The degradation in each tick of the fault.
    """
    match kind:
        case ImpulseFault():
            return _bump(kind, source, parts)
        case CarryFault():
            return _carry(kind, source, parts)
        case BoxFault():
            return _put(kind, source, parts)
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
        case CoveredScannerFault(scanner, lasts, share):
            return repeat(Degradation(covered={scanner: share}), lasts)
        case SilentScannerFault(scanner, lasts):
            return repeat(Degradation(silent=frozenset((scanner,))), lasts)
        case PersonEntersFault(person):
            parts.people.add_person(replace(person, name=name))
            return iter(())


def _bump(bump: ImpulseFault, source: Generator, parts: PlantParts) -> Iterator[Degradation]:
    direction = _random_horizontal(source) if bump.direction is None else bump.direction
    force = bump.impulse / (bump.over * TICK)
    body = parts.scene.body(bump.thing)
    for _ in range(bump.over):
        parts.world.push(body, (force * direction[0], force * direction[1], force * direction[2]))
        yield NO_DEGRADATION


def _put(put: BoxFault, source: Generator, parts: PlantParts) -> Iterator[Degradation]:
    x, y, z = _draw_place(put, source, parts)
    goal = (x, y, z + put.box[2] / 2.0)
    start = add(goal, (0.0, 0.0, _BROUGHT_FROM))
    half = (put.box[0] / 2.0, put.box[1] / 2.0, put.box[2] / 2.0)
    while parts.engine.is_occupied(subtract(goal, half), add(start, half), parts.robot.body):
        yield NO_DEGRADATION
    body = parts.engine.add_box(put.box, start, mass=put.mass, colour=_BOX_COLOUR)
    strength = max(MAX_FORCE, _STRENGTH_BY_WEIGHT * put.mass * GRAVITY)
    hand = parts.engine.carry(body, goal, 0.0, (0.0, 0.0, 1.0), lift=0.0, strength=strength)
    for tick in range(1, put.over + 1):
        hand.push(tick / put.over)
        yield NO_DEGRADATION


def _draw_place(fault: CarryFault | BoxFault, source: Generator, parts: PlantParts) -> Vector3:
    """Draw the place to which a fault brings something, in W, m."""
    spread = np.array(fault.spread)
    place = np.array(fault.to) + source.uniform(-spread, spread)
    if fault.of:
        place = place + np.array(parts.world.pose(parts.scene.body(fault.of)).position)
    x, y, z = place.tolist()
    return x, y, z


def _carry(carry: CarryFault, source: Generator, parts: PlantParts) -> Iterator[Degradation]:
    x, y, z = _draw_place(carry, source, parts)
    axis = _random_horizontal(source) if carry.about is None else carry.about
    body = parts.scene.body(carry.thing)
    take = partial(parts.engine.carry, turn=carry.turn, axis=axis, lift=LIFT, strength=MAX_FORCE)
    carriers = [take(body, (x, y, z))]
    if carry.inside:
        content = parts.scene.body(carry.inside)
        away = subtract(parts.world.pose(content).position, parts.world.pose(body).position)
        half = sin(carry.turn / 2.0)
        turned = (half * axis[0], half * axis[1], half * axis[2], cos(carry.turn / 2.0))
        goal = to_world(Pose((x, y, z), turned), away)
        carriers.append(take(content, goal))
    for tick in range(1, carry.over + 1):
        for carrier in carriers:
            carrier.push(tick / carry.over)
        yield NO_DEGRADATION


def picture_effect(kind: PictureFault, source: Generator) -> PictureEffect:
    """Make the effect of a fault on one picture.

    Args:
        kind: the fault.
        source: random numbers of this occurrence.

    Returns:
        A function that dazzles the camera, so that it sees white and nothing near; or that moves the place
        from which it says that it took the picture.
    """
    match kind:
        case MisplacedPictureFault(by, direction):
            x, y, z = _random_horizontal(source) if direction is None else direction
            return partial(_misplaced, by=(by * x, by * y, by * z))
        case MissedPictureFault():
            return _dazzled


def _dazzled(picture: CameraPicture) -> CameraPicture:
    pixels = picture.width * picture.height
    depth = None if picture.depth is None else np.full(pixels, _FAR, np.float32).tobytes()
    return replace(picture, rgb=b"\xff" * (3 * pixels), depth=depth)


def _misplaced(picture: CameraPicture, by: Vector3) -> CameraPicture:
    view = picture.view
    return replace(picture, view=view._replace(eye=add(view.eye, by), target=add(view.target, by)))


def _random_horizontal(source: Generator) -> Vector3:
    """Draw a horizontal unit vector."""
    angle = float(source.uniform(-pi, pi))
    return (cos(angle), sin(angle), 0.0)

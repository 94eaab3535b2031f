"""Entities of a scene: volumes of the site, measured things, links of the robot, simulated people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from aeros.runtime.bus.measurement_messages import WORLD
from aeros.runtime.bus.messages import Point, Time, Vector3, stamp
from aeros.runtime.bus.transforms import BASE, link_frame
from aeros.runtime.bus.viewer.foxglove_messages import (
    Color,
    CubePrimitive,
    CylinderPrimitive,
    Duration,
    KeyValuePair,
    ModelPrimitive,
    PoseMessage,
    SceneEntity,
    SpherePrimitive,
    TextPrimitive,
)
from aeros.runtime.bus.viewer.hull_meshes import encode_glb
from aeros.runtime.bus.viewer.link_visuals import LINK_COLOUR, link_model
from aeros.runtime.bus.viewer.things import SceneThing
from aeros.runtime.ports import Ball, Hull, LinkModel, PersonFigure, Reading, RobotBody, Vec3
from aeros.spec.model.site import Site

_ZONE: Final = Color(0.0, 0.45, 0.7, 0.15)
_ZONE_TEXT: Final = Color(0.0, 0.45, 0.7)
_THING: Final = Color(0.9, 0.6, 0.0, 0.35)
_THING_TEXT: Final = Color(0.9, 0.6, 0.0)
_PERSON: Final = Color(0.84, 0.37, 0.0, 0.5)
_PERSON_TEXT: Final = Color(0.84, 0.37, 0.0)

_MARK: Final = 0.03
"""Diameter of the ball at a thing whose size is unknown, m."""


def zone_entities(site: Site, when: Time) -> tuple[SceneEntity, ...]:
    """Make a box with its name for each volume of a site.

    Args:
        site: the site.
        when: time stamp.

    Returns:
        The entities.
    """
    found = []
    for name, volume in site.volumes.items():
        low, high = _point(volume.lower), _point(volume.upper)
        texts = (_label(low, high, name, _ZONE_TEXT),)
        found.append(SceneEntity(when, WORLD, name, cubes=(_box(low, high, _ZONE),), texts=texts))
    return tuple(found)


def thing_entity(thing: SceneThing, reading: Reading) -> SceneEntity:
    """Make the entity of a thing at its measured place; it disappears once the measurement is too old.

    Args:
        thing: the thing.
        reading: its place in W, m.

    Returns:
        A box of the space that it occupies, or a ball if that is unknown, with its name.
    """
    place, age = _point(reading.value), stamp(thing.max_age)
    half = _MARK / 2.0
    low, high = thing.box or ((-half, -half, -half), (half, half, half))
    low, high = _sum(place, low), _sum(place, high)
    return SceneEntity(
        stamp(reading.time),
        WORLD,
        thing.variable,
        Duration(age.sec, age.nanosec),
        cubes=() if thing.box is None else (_box(low, high, _THING),),
        spheres=(_ball(place, _MARK, _THING_TEXT),) if thing.box is None else (),
        texts=(_label(low, high, thing.label, _THING_TEXT),),
    )


def person_entity(number: int, person: PersonFigure, when: Time) -> SceneEntity:
    """Make the entity of a simulated person: the capsule that the simulator has.

    Args:
        number: number of the person, from 1.
        person: where they are.
        when: time stamp.

    Returns:
        The capsule with its name.
    """
    x, y, floor, height, radius = person
    low, high = floor + radius, floor + height - radius
    middle = Point(x, y, (low + high) / 2.0)
    trunk = CylinderPrimitive(
        PoseMessage(middle), Vector3(2.0 * radius, 2.0 * radius, high - low), color=_PERSON
    )
    ends = tuple(_ball((x, y, z), 2.0 * radius, _PERSON) for z in (low, high))
    name = f"person {number}, simulated"
    text = _label((x, y, floor), (x, y, floor + height), name, _PERSON_TEXT)
    return SceneEntity(when, WORLD, name, spheres=ends, cylinders=(trunk,), texts=(text,))


def link_entities(
    body: RobotBody, joints: Sequence[str], when: Time, models: Mapping[Hull, LinkModel]
) -> tuple[SceneEntity, ...]:
    """Make the shape of each link of a robot, in the frame that moves with it.

    Args:
        body: the robot.
        joints: names of the joints, one for each row of the chain.
        when: time stamp.
        models: how viewers draw the links, by hull.

    Returns:
        The entities: meshes of the links, of their models or else of their hulls; or the balls of a robot
        whose hulls are unknown.
    """
    frames = (BASE, *map(link_frame, joints))
    meshes = tuple(_meshes(body.hulls, frames, when, models))
    return meshes or tuple(_balls(body.balls, frames, when))


def _meshes(
    hulls: Sequence[Hull], frames: Sequence[str], when: Time, models: Mapping[Hull, LinkModel]
) -> Iterator[SceneEntity]:
    for hull in hulls:
        surfaces, origin = link_model(hull, models)
        if surfaces:
            yield SceneEntity(
                when,
                frames[hull.joint],
                hull.link,
                frame_locked=True,
                metadata=(KeyValuePair("origin", origin),) if origin else (),
                models=(ModelPrimitive(override_color=False, data=encode_glb(surfaces)),),
            )


def _balls(balls: Sequence[Ball], frames: Sequence[str], when: Time) -> Iterator[SceneEntity]:
    for number, ball in enumerate(balls):
        spheres = (_ball(ball.centre, 2.0 * ball.radius, Color(*LINK_COLOUR)),)
        name = f"{ball.link}-{number}"
        yield SceneEntity(when, frames[ball.joint], name, frame_locked=True, spheres=spheres)


def _box(low: Vec3, high: Vec3, colour: Color) -> CubePrimitive:
    middle = Point(*((a + b) / 2.0 for a, b in zip(low, high, strict=True)))
    edges = Vector3(*(b - a for a, b in zip(low, high, strict=True)))
    return CubePrimitive(PoseMessage(middle), edges, colour)


def _ball(middle: Vec3, diameter: float, colour: Color) -> SpherePrimitive:
    return SpherePrimitive(PoseMessage(Point(*middle)), Vector3(diameter, diameter, diameter), colour)


def _label(low: Vec3, high: Vec3, text: str, colour: Color) -> TextPrimitive:
    above = Point((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, high[2])
    return TextPrimitive(PoseMessage(above), color=colour, text=text)


def _sum(one: Vec3, other: Vec3) -> Vec3:
    return (one[0] + other[0], one[1] + other[1], one[2] + other[2])


def _point(value: Sequence[object]) -> Vec3:
    x, y, z = (float(one) for one in value)  # type: ignore[arg-type]
    return (x, y, z)

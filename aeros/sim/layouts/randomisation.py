"""Randomised scenes: properties of bodies, light and sensors drawn from the ranges in scene files.

Places are drawn by `placement.py` in every run; a range only widens their spread.  Each number has a random
stream of its own, so another body in a scene changes nothing that is drawn for the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import exp, log
from typing import NamedTuple

from aeros.sim.randomness import RandomSource
from aeros.spec.model.scene import (
    BodyVariation,
    Colour,
    Compound,
    Pair,
    Scene,
    SceneBody,
    SceneVariation,
    UrdfModel,
)


class RandomisedScene(NamedTuple):
    """A scene as it was drawn.

    Attributes:
        scene: the scene.
        drawn: factors and changes that were drawn, by `BODY.PROPERTY` or `PROPERTY`.
    """

    scene: Scene
    drawn: Mapping[str, float | Colour]


def has_ranges(scene: Scene) -> bool:
    """Say if there is something to draw.

    Args:
        scene: the scene.

    Returns:
        True if the scene or one of its bodies declares ranges.
    """
    return scene.variation is not None or any(one.variation is not None for one in scene.bodies.values())


def randomise_scene(scene: Scene, seed: int) -> RandomisedScene:
    """Draw the properties for which a scene declares ranges.

    Factors are log-uniform: half and double are equally far from 1.

    Args:
        scene: the scene.
        seed: seed of all random numbers; the same seed gives the same scene.

    Returns:
        The scene, and what was drawn.
    """
    draw = _Draw(RandomSource(seed))
    variation = scene.variation or SceneVariation()
    light = draw.factor("light", variation.light)
    sensors = draw.factor("sensors", variation.sensors)
    bodies = {
        name: _lit(one if one.variation is None else _vary(one, one.variation, draw), light)
        for name, one in scene.bodies.items()
    }
    return RandomisedScene(replace(scene, bodies=bodies, sensor_factor=sensors), draw.drawn)


class _Draw:
    """Draws numbers and keeps them."""

    def __init__(self, chance: RandomSource) -> None:
        self._chance = chance
        self.drawn: dict[str, float | Colour] = {}

    def factor(self, name: str, bounds: Pair) -> float:
        """Draw a factor; one whose range holds a single number is not kept."""
        low, high = bounds
        if low == high:
            return low
        found = exp(float(self._chance.generator(f"randomise {name}").uniform(log(low), log(high))))
        # Rounding of the logarithms may leave the range by one unit in the last place.
        found = min(max(found, low), high)
        self.drawn[name] = found
        return found

    def change(self, name: str, most: float) -> Colour:
        """Draw a change of a colour."""
        if most == 0.0:
            return (0.0, 0.0, 0.0)
        red, green, blue = map(float, self._chance.generator(f"randomise {name}").uniform(-most, most, 3))
        self.drawn[name] = (red, green, blue)
        return (red, green, blue)


def _vary(body: SceneBody, ranges: BodyVariation, draw: _Draw) -> SceneBody:
    mass = draw.factor(f"{body.name}.mass", ranges.mass)
    friction = draw.factor(f"{body.name}.friction", ranges.friction)
    change = draw.change(f"{body.name}.colour", ranges.colour)
    dx, dy, dz = (a + b for a, b in zip(body.placement.spread, ranges.spread, strict=True))
    placement = body.placement._replace(
        spread=(dx, dy, dz), yaw_spread=body.placement.yaw_spread + ranges.yaw_spread
    )
    shape = body.shape
    if isinstance(shape, UrdfModel):
        links = {name: friction * one for name, one in shape.link_friction.items()}
        shape = shape._replace(link_friction=links)
    elif isinstance(shape, Compound):
        parts = (one._replace(colour=_changed(one.colour, change)) for one in shape.parts)
        shape = shape._replace(parts=tuple(parts))
    return replace(
        body,
        shape=shape,
        placement=placement,
        mass=mass * body.mass,
        friction=friction * body.friction,
        colour=_changed(body.colour, change),
    )


def _changed(colour: Colour, change: Colour) -> Colour:
    red, green, blue = (_share(a + b) for a, b in zip(colour, change, strict=True))
    return (red, green, blue)


def _lit(body: SceneBody, light: float) -> SceneBody:
    """Return a body in another light; the colours of a model's file stay."""
    if light == 1.0:
        return body
    shape = body.shape
    if isinstance(shape, Compound):
        parts = (one._replace(colour=_dimmed(one.colour, light)) for one in shape.parts)
        shape = shape._replace(parts=tuple(parts))
    return replace(body, shape=shape, colour=_dimmed(body.colour, light))


def _dimmed(colour: Colour, light: float) -> Colour:
    red, green, blue = (_share(light * one) for one in colour)
    return (red, green, blue)


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)

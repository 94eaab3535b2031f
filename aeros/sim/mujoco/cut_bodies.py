"""Level sections of the bodies of a MuJoCo world, of the shapes that they collide with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from aeros.sim.mujoco.model import BuiltModel, pose_of
from aeros.sim.mujoco.plans import ShapePlan
from aeros.sim.mujoco.world import MujocoWorld
from aeros.sim.pictures.ray_caster import place
from aeros.sim.pictures.solids import Array, Solid, box, cylinder, sphere
from aeros.sim.scanners.sections import Section, cut, rectangle
from aeros.spec.model.scene import GREY

_PLACES: Final = 3
"""Decimal places of a metre of a shape's bounds that matter: what moves by less has not moved."""


class MujocoCutPlane:
    """Sections of all bodies but some; computed anew only when a shape that the plane meets has moved.

    Args:
        world: the world.
        height: of the plane in W, m.
        left_out: says which bodies do not count, by their numbers.
    """

    def __init__(self, world: MujocoWorld, height: float, left_out: Callable[[], Sequence[int]]) -> None:
        self._world = world
        self._height = height
        self._left_out = left_out
        self._key = b""
        self._sections: tuple[Section, ...] = ()

    def sections(self) -> tuple[Section, ...]:
        """Implement `CutPlane.sections`."""
        built = self._world.bodies.built()
        low, high = bounds_of(built)
        counts = ~np.isin(built.owners[:, 0], self._left_out())
        met = np.flatnonzero(counts & (low[:, 2] < self._height) & (self._height < high[:, 2]))
        key = met.tobytes() + np.round(np.concatenate((low[met], high[met])), _PLACES).tobytes()
        if key != self._key:
            self._key = key
            self._sections = tuple(self._cut(built, met.tolist(), low, high))
        return self._sections

    def _cut(self, built: BuiltModel, shapes: Sequence[int], low: Array, high: Array) -> Iterator[Section]:
        for number in shapes:
            plan = self._world.bodies.geoms[number].shape
            solid = _solid(plan)
            if solid is None:
                (a, b), (c, d) = low[number, :2].tolist(), high[number, :2].tolist()
                yield rectangle((a, b), (c, d))
                continue
            owner = built.model.geom_bodyid[number]
            frame = pose_of(built.data.xpos[owner], built.data.xquat[owner])
            section = cut(place(solid._replace(place=plan.place), frame), self._height)
            if section is not None:
                yield section


def bounds_of(built: BuiltModel) -> tuple[Array, Array]:
    """Bound each shape by a box along the axes of W.

    Args:
        built: the model.

    Returns:
        The lowest and the highest corner of each (n, 3), m.
    """
    model, data = built.model, built.data
    axes = data.geom_xmat.reshape(-1, 3, 3)
    middle = data.geom_xpos + np.einsum("nij,nj->ni", axes, model.geom_aabb[:, :3])
    half = np.einsum("nij,nj->ni", np.abs(axes), model.geom_aabb[:, 3:])
    return middle - half, middle + half


def _solid(plan: ShapePlan) -> Solid | None:
    match plan.kind:
        case "box":
            return box(plan.size, GREY)
        case "cylinder":
            return cylinder(plan.size[0], plan.size[1], GREY)
        case "sphere":
            return sphere(plan.size[0], GREY)
        case "capsule" | "hull":
            return None

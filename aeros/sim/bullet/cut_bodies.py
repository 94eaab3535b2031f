"""Level sections of the bodies of a PyBullet world, of the shapes that they collide with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Pose
from aeros.sim.pictures.ray_caster import place
from aeros.sim.pictures.solids import Solid, box, cylinder, sphere
from aeros.sim.scanners.sections import Section, cut, rectangle
from aeros.spec.model.scene import GREY

_PLACES: Final = 3
"""Decimal places of a metre of a body's bounds that matter: what moves by less has not moved."""


class CutBodies:
    """Sections of all bodies but some; computed anew only when a body that the plane meets has moved.

    Args:
        world: the world.
        height: of the plane in W, m.
        left_out: says which bodies do not count, by their numbers.
    """

    def __init__(self, world: PhysicsWorld, height: float, left_out: Callable[[], Sequence[int]]) -> None:
        self._client = world.client
        self._height = height
        self._left_out = left_out
        self._links: dict[int, int] = {}
        self._key: tuple[Any, ...] = ()
        self._sections: tuple[Section, ...] = ()

    def sections(self) -> tuple[Section, ...]:
        """Cut the bodies where they are now.

        Returns:
            The sections; the same object as long as nothing has moved.
        """
        key = tuple(self._met())
        if key != self._key:
            self._key = key
            self._sections = tuple(
                section for body, link, low, high in key for section in self._cut(body, link, low, high)
            )
        return self._sections

    def _met(self) -> Iterator[tuple[int, int, tuple[float, ...], tuple[float, ...]]]:
        """Yield body, link and bounds of each link whose bounds the plane meets."""
        client, height, left_out = self._client, self._height, set(self._left_out())
        for index in range(bullet.getNumBodies(physicsClientId=client)):
            body = bullet.getBodyUniqueId(index, physicsClientId=client)
            if body in left_out:
                continue
            for link in range(-1, self._link_count(body)):
                low, high = bullet.getAABB(body, link, physicsClientId=client)
                if low[2] < height < high[2]:
                    yield (
                        body,
                        link,
                        tuple([round(one, _PLACES) for one in low]),
                        tuple([round(one, _PLACES) for one in high]),
                    )

    def _link_count(self, body: int) -> int:
        count = self._links.get(body)
        if count is None:
            count = self._links[body] = bullet.getNumJoints(body, physicsClientId=self._client)
        return count

    def _cut(self, body: int, link: int, low: Sequence[float], high: Sequence[float]) -> Iterator[Section]:
        frame = self._frame(body, link)
        for shape in bullet.getCollisionShapeData(body, link, physicsClientId=self._client):
            solid = _solid(shape[2], shape[3])
            if solid is None:  # a mesh
                yield rectangle((low[0], low[1]), (high[0], high[1]))
                continue
            section = cut(place(solid._replace(place=Pose(shape[5], shape[6])), frame), self._height)
            if section is not None:
                yield section

    def _frame(self, body: int, link: int) -> Pose:
        """Return the frame in which PyBullet gives the shapes of a link: that of its centre of mass."""
        if link < 0:
            return Pose(*bullet.getBasePositionAndOrientation(body, physicsClientId=self._client))
        return Pose(*bullet.getLinkState(body, link, physicsClientId=self._client)[:2])


def _solid(kind: int, size: Sequence[float]) -> Solid | None:
    if kind == bullet.GEOM_BOX:
        return box((size[0], size[1], size[2]), GREY)
    if kind == bullet.GEOM_CYLINDER:
        return cylinder(size[1], size[0], GREY)
    if kind == bullet.GEOM_SPHERE:
        return sphere(size[0], GREY)
    return None

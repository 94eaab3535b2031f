"""Pictures of a MuJoCo world by a ray for each pixel, as the kinematic plant takes them: without OpenGL."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from aeros.sim.engine.world import PERSON_COLOUR, Image
from aeros.sim.geometry import UPRIGHT, Camera, Pose
from aeros.sim.mujoco.model import GrowingModel, pose_of
from aeros.sim.mujoco.plans import ShapePlan
from aeros.sim.pictures.ray_caster import Decal, PlacedSolid, cast, place
from aeros.sim.pictures.solids import Solid, cylinder, sphere


class RayRenderer:
    """Renders pictures of one world.

    Args:
        bodies: the model of the world.

    Attributes:
        robot: yields the solids of the robot; none by default.
    """

    def __init__(self, bodies: GrowingModel) -> None:
        self._bodies = bodies
        self.robot: Callable[[], Iterator[PlacedSolid]] = lambda: iter(())
        self._decals: list[Decal] = []

    def add_rectangle(self, low: tuple[float, float], high: tuple[float, float], height: float) -> int:
        """Add a level rectangle to paint on.

        Args:
            low: corner with the least x and y in W, m.
            high: corner with the greatest x and y in W, m.
            height: of the surface that it is on, in W, m.

        Returns:
            Its number.
        """
        self._decals.append(Decal(low, high, height, np.full((1, 1, 3), 255, dtype=np.uint8)))
        return len(self._decals) - 1

    def paint(self, body: int, rgb: NDArray[np.uint8]) -> None:
        """Implement `EngineRenderer.paint`."""
        self._decals[body] = self._decals[body]._replace(pixels=rgb)

    def render(self, camera: Camera) -> Image:
        """Implement `EngineRenderer.render`."""
        rgb, depth = cast(camera, (*self._placed(), *self.robot()), self._decals)
        return Image(rgb, depth.astype(np.float64))

    def _placed(self) -> Iterator[PlacedSolid]:
        _, data, links, *_ = self._bodies.built()
        for number, body in enumerate(self._bodies.bodies):
            for index, link in enumerate(body, -1):
                if not link.visuals:
                    continue
                at = links[number, index]
                pose = pose_of(data.xpos[at], data.xquat[at])
                yield from (place(solid, pose) for solid in link.visuals)


def person_solids(capsule: ShapePlan) -> tuple[Solid, ...]:
    """Show a person: a capsule is a cylinder between two spheres.

    Args:
        capsule: the capsule.

    Returns:
        The solids.
    """
    radius, length, _ = capsule.size
    colour = PERSON_COLOUR[:3]
    ends = (Pose((0.0, 0.0, side * length / 2.0), UPRIGHT) for side in (-1.0, 1.0))
    return (cylinder(radius, length, colour), *(sphere(radius, colour)._replace(place=end) for end in ends))

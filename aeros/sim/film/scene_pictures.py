"""Draw a `FilmModel` with MuJoCo's renderer, with marks that are no bodies: lines, rings and boxes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from math import cos, pi, radians, sin, tan
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.engine.world import Rgba
from aeros.sim.film.film_model import HIDDEN_GROUP, FilmModel
from aeros.sim.geometry import Camera, Vector3, camera_axes
from aeros.sim.mujoco.client import mujoco

MARKS_MAX: Final = 2_000
"""Greatest number of shapes that marks of a picture may consist of."""

_RING_SEGMENTS: Final = 72

_GLOW: Final = 0.1
"""Share of its colour that a mark has without light."""


class Line(NamedTuple):
    """A line through points.

    Attributes:
        points: in W, m.
        width: m.
        colour: its colour.
    """

    points: Sequence[Vector3]
    width: float
    colour: Rgba


class FloorRing(NamedTuple):
    """A level disc with a rim.

    Attributes:
        middle: in W, m.
        radius: m.
        colour: of the rim.
        fill: opacity inside.
    """

    middle: Vector3
    radius: float
    colour: Rgba
    fill: float


class Zone(NamedTuple):
    """A box with edges along the axes of W.

    Attributes:
        low: lowest corner in W, m.
        high: highest corner in W, m.
        colour: its colour; edges are opaque.
    """

    low: Vector3
    high: Vector3
    colour: Rgba


class Dot(NamedTuple):
    """A ball.

    Attributes:
        middle: in W, m.
        radius: m.
        colour: its colour.
    """

    middle: Vector3
    radius: float
    colour: Rgba


Mark = Line | FloorRing | Zone | Dot


class ScenePictures:
    """Draws pictures of a model; an OpenGL context must be current as long as it is used.

    Args:
        film: the model.
        size: width and height of the greatest picture, pixels.
    """

    def __init__(self, film: FilmModel, size: tuple[int, int]) -> None:
        self._film = film
        self._size = size
        self._scene = mujoco.MjvScene(film.model, maxgeom=film.model.ngeom + MARKS_MAX)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = True
        self._scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = True
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._options = mujoco.MjvOption()
        self._options.geomgroup[HIDDEN_GROUP] = 0
        self._camera = mujoco.MjvCamera()
        self._context = mujoco.MjrContext(film.model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)

    def draw(
        self, camera: Camera, marks: Iterable[Mark] = (), *, has_shadows: bool = True
    ) -> NDArray[np.uint8]:
        """Draw a picture.

        Args:
            camera: in W; its width and height are those of the picture.
            marks: what is drawn besides the bodies.
            has_shadows: draw shadows, which takes half of the time.

        Returns:
            The picture (height, width, 3), 0 to 255.
        """
        scene, film = self._scene, self._film
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = has_shadows
        mujoco.mjv_updateScene(
            film.model,
            film.data,
            self._options,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            scene,
        )
        for mark in marks:
            for kind, size, position, axes, colour in _geoms_of(mark):
                if scene.ngeom >= scene.maxgeom:
                    break
                geom = scene.geoms[scene.ngeom]
                mujoco.mjv_initGeom(geom, kind, size, position, axes, np.array(colour, dtype=np.float32))
                geom.category = mujoco.mjtCatBit.mjCAT_DECOR
                geom.emission, geom.specular = _GLOW, 0.0
                scene.ngeom += 1
        self._aim(camera)
        pixels = np.empty((camera.height, camera.width, 3), dtype=np.uint8)
        place = mujoco.MjrRect(0, 0, camera.width, camera.height)
        mujoco.mjr_render(place, scene, self._context)
        mujoco.mjr_readPixels(pixels, None, place, self._context)
        return np.flipud(pixels)

    def _aim(self, camera: Camera) -> None:
        _, up, ahead = camera_axes(camera)
        near, far = 0.02, 40.0
        half = near * tan(radians(camera.field_of_view) / 2.0)
        for one in self._scene.camera:
            one.pos, one.forward, one.up = camera.eye, ahead, up
            one.frustum_near, one.frustum_far = near, far
            one.frustum_top, one.frustum_bottom = half, -half
            one.frustum_center = 0.0
            one.frustum_width = half * camera.width / camera.height
            one.orthographic = 0


def _geoms_of(mark: Mark) -> Iterator[tuple[Any, Any, Any, Any, Rgba]]:
    """Yield MuJoCo's type, size, position, axes and colour of the shapes of a mark."""
    kinds, upright = mujoco.mjtGeom, np.eye(3).ravel()
    match mark:
        case Line(points, width, colour):
            for start, end in pairwise(points):
                found = _between(np.array(start), np.array(end))
                if found is not None:
                    middle, half, axes = found
                    yield kinds.mjGEOM_CAPSULE, np.array((width / 2.0, half, half)), middle, axes, colour
        case FloorRing(middle, radius, colour, fill):
            red, green, blue, _ = colour
            if fill > 0.0:
                size = np.array((radius, 0.0005, 0.0))
                yield kinds.mjGEOM_CYLINDER, size, np.array(middle), upright, (red, green, blue, fill)
            half = radius * sin(pi / _RING_SEGMENTS)
            for number in range(_RING_SEGMENTS):
                angle = 2.0 * pi * number / _RING_SEGMENTS
                c, s = cos(angle), sin(angle)
                axes = np.array((c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0))
                at = np.array(middle) + np.array((radius * c, radius * s, 0.002))
                yield kinds.mjGEOM_BOX, np.array((0.012, half, 0.002)), at, axes, colour
        case Zone(low, high, colour):
            a, b = np.array(low), np.array(high)
            yield kinds.mjGEOM_BOX, (b - a) / 2.0, (a + b) / 2.0, upright, colour
            edge = (*colour[:3], 0.4)
            for axis in range(3):
                one, other = (axis + 1) % 3, (axis + 2) % 3
                for first in (a[one], b[one]):
                    for second in (a[other], b[other]):
                        at, size = (a + b) / 2.0, np.full(3, 0.002)
                        at[one], at[other] = first, second
                        size[axis] = (b[axis] - a[axis]) / 2.0
                        yield kinds.mjGEOM_BOX, size, at, upright, edge
        case Dot(middle, radius, colour):
            yield kinds.mjGEOM_SPHERE, np.full(3, radius), np.array(middle), upright, colour


def _between(start: NDArray[np.float64], end: NDArray[np.float64]) -> tuple[Any, float, Any] | None:
    """Return middle, half length and axes of a capsule from one point to another; None if they are one."""
    way = end - start
    length = float(np.linalg.norm(way))
    if length < 1e-6:
        return None
    z = way / length
    x = np.cross(z, (0.0, 0.0, 1.0) if abs(z[2]) < 0.9 else (1.0, 0.0, 0.0))
    x /= np.linalg.norm(x)
    return (start + end) / 2.0, length / 2.0, np.stack((x, np.cross(z, x), z), axis=1).ravel()

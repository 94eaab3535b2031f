"""Pictures of flat tops, drawn without a simulator: what a camera that looks straight down sees of them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from aeros.sim.bullet.renderer import Image
from aeros.sim.geometry import Camera
from aeros.sim.perception.detection import camera_points

Colour = tuple[int, int, int]
GREY: Colour = (128, 128, 128)
TABLE: Colour = (200, 200, 200)


class Top(NamedTuple):
    """A top: a rectangle, or a disc of radius `half[0]`; m and rad. A slope lowers it along its length."""

    x: float
    y: float
    z: float
    half: tuple[float, float]
    colour: Colour
    yaw: float = 0.0
    is_round: bool = False
    slope: float = 0.0


def draw(camera: Camera, tops: Iterable[Top], ground: Colour = TABLE) -> Image:
    """The picture of these tops over the ground at z = 0; of several the highest is seen."""
    height = camera.eye[2]
    rays = camera_points(np.ones((camera.height, camera.width)), camera) - np.array(camera.eye)
    depth = np.full((camera.height, camera.width), height)
    rgb = np.full((camera.height, camera.width, 3), ground, np.uint8)
    for top in tops:
        # Where a ray meets a slope is found step by step: rays are nearly vertical.
        here = np.full_like(depth, height - top.z)
        for _ in range(8):
            x = camera.eye[0] + here * rays[:, :, 0] - top.x
            y = camera.eye[1] + here * rays[:, :, 1] - top.y
            u, v = x * np.cos(top.yaw) + y * np.sin(top.yaw), y * np.cos(top.yaw) - x * np.sin(top.yaw)
            here = height - top.z + top.slope * u
        inside = (
            np.hypot(u, v) < top.half[0] if top.is_round else (abs(u) < top.half[0]) & (abs(v) < top.half[1])
        )
        seen = inside & (here < depth)
        depth[seen] = here[seen]
        rgb[seen] = top.colour
    return Image(rgb, depth)

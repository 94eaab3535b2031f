"""Finding an object in a picture by its colour and depth, without asking the simulator.

A pixel's point: p_W = eye + depth · (forward + x·right + y·up), where x and y are the pixel's place on
the image plane at distance 1.  Units: m.  Frame: W.
"""

from __future__ import annotations

from math import radians, tan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Camera, Triple
from aeros.sim.world import Image

PIXELS_MIN: Final = 25
"""Fewest pixels of a detection: less is noise or an object mostly hidden."""

DOMINANCE: Final = 2.0
"""How many times red exceeds green and blue in a red pixel, whatever the light."""

BRIGHTNESS: Final = 60
"""Least red of a red pixel (of 255)."""

FACE: Final = 0.004
"""Depth below the highest point that still belongs to the top face, m."""


def find_red(image: Image, camera: Camera, height: float) -> Triple | None:
    """Middle of the one red upright object of known `height` (m) in `image`, in W; None when not seen.

    The top face gives the middle in x and y: the visible side is the camera's side, so the middle of
    all points would be biased towards the camera.  Assumes an upright object whose top is in sight.
    """
    rgb = image.rgb.astype(np.float64)
    others = np.maximum(rgb[:, :, 1], rgb[:, :, 2])
    red = (rgb[:, :, 0] > BRIGHTNESS) & (rgb[:, :, 0] > DOMINANCE * others)
    if int(red.sum()) < PIXELS_MIN:
        return None
    points = points_of(image.depth, camera)[red]
    top = float(points[:, 2].max())
    face = points[points[:, 2] > top - FACE]
    x, y = (face[:, :2].min(axis=0) + face[:, :2].max(axis=0)) / 2.0
    return (float(x), float(y), float(np.median(face[:, 2])) - height / 2.0)


def points_of(depth: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """The point in W of every pixel, (height, width, 3)."""
    eye = np.array(camera.eye)
    forward = np.array(camera.target) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.array(camera.up))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = tan(radians(camera.field_of_view) / 2.0)
    aspect = camera.width / camera.height
    x = (2.0 * (np.arange(camera.width) + 0.5) / camera.width - 1.0) * half * aspect
    y = (1.0 - 2.0 * (np.arange(camera.height) + 0.5) / camera.height) * half
    rays = forward + x[None, :, None] * right + y[:, None, None] * up
    points: NDArray[np.float64] = eye + depth[:, :, None] * rays
    return points

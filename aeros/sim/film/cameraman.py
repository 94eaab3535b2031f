"""The camera of a film: it holds the whole arm and who comes near, and turns slowly around them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, cos, hypot, pi, radians, sin
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.film.recording import PoseSample, Recording
from aeros.sim.geometry import Camera, Vector3

CameraMode = Literal["orbit", "fixed"]

_FIELD_OF_VIEW: Final = 34.0
"""Vertical angle of view, degrees."""

_ELEVATION: Final = radians(27.0)
_SWING: Final = radians(16.0)
"""Greatest angle by which an orbiting camera is off its middle."""

_SWING_PERIOD: Final = 26.0
"""Time of a swing there and back in the film, s."""

_ARM_RADIUS: Final = 0.84
"""Radius of the ball that holds the arm and what it works on, m."""

_CLOSE: Final = 0.42
"""Level distance of the camera near the hand, m."""

_NEAR: Final[Mapping[CameraMode, float]] = {"orbit": 3.2, "fixed": 2.4}
"""Distance from the arm's base within which a person is in the picture, m; a fixed one lets them walk in."""

_SMOOTHING: Final = 1.6
"""Time over which the camera follows, s of the film."""

_MARGIN: Final = 1.08
"""Height of a picture over that of the things in it."""

_DEPTH: Final = 0.38
"""Addition to it for a person, who may be nearer to the camera than the arm."""

_ASIDE: Final = 0.16
"""Share of half a wide picture's width by which things are left of its middle: insets are at the right."""

_RISE: Final = 0.14
"""Share of the picture's height by which things are above its middle: captions are below."""


class _Ball(NamedTuple):
    """A ball that is to be in the picture, m.

    Attributes:
        x, y, z: its middle.
        radius: its radius.
        height: radius of the greatest ball in it that is not beside another one.
    """

    x: float
    y: float
    z: float
    radius: float
    height: float


def plan_cameras(
    recording: Recording, samples: Sequence[PoseSample], mode: CameraMode, size: tuple[int, int], rate: float
) -> list[Camera]:
    """Choose the camera of each picture.

    Args:
        recording: the recording.
        samples: the pictures of the film.
        mode: `orbit` turns around the arm, `fixed` stays where it is best on the whole.
        size: width and height, pixels.
        rate: pictures per second of the film.

    Returns:
        The cameras.
    """
    balls = np.array([_ball(recording, sample, _NEAR[mode]) for sample in samples])
    if mode == "fixed":
        low, high = balls[:, :3].min(axis=0), balls[:, :3].max(axis=0)
        middle = (low + high) / 2.0
        reach = np.linalg.norm(balls[:, :3] - middle, axis=1) + balls[:, 3]
        balls = np.tile(np.array([*middle, reach.max(), balls[:, 4].max()]), (len(samples), 1))
    else:
        balls = _smoothed(balls, max(1, round(_SMOOTHING * rate)))
    azimuth = _azimuth(recording, samples, _NEAR[mode])
    cameras = []
    for number, (x, y, z, radius, height) in enumerate(balls.tolist()):
        swing = _SWING * sin(2.0 * pi * number / (rate * _SWING_PERIOD)) if mode == "orbit" else 0.0
        margin = _MARGIN + _DEPTH * min(1.0, (height / _ARM_RADIUS - 1.0) / 0.1)
        held = max(margin * height, radius * size[1] / size[0])
        distance = held / sin(radians(_FIELD_OF_VIEW) / 2.0)
        turn = azimuth + swing
        # The point that it looks at is below the middle, so that the middle is above that of the picture.
        aside = _ASIDE * held * size[0] / size[1] if size[0] > 1.5 * size[1] else 0.0
        x, y = x - aside * sin(turn), y + aside * cos(turn)
        target = (x, y, z - 2.0 * _RISE * held)
        eye = (
            x + distance * cos(_ELEVATION) * cos(turn),
            y + distance * cos(_ELEVATION) * sin(turn),
            z + distance * sin(_ELEVATION),
        )
        cameras.append(
            Camera(eye, target, field_of_view=_FIELD_OF_VIEW, width=size[0], height=size[1], far=40.0)
        )
    return cameras


def close_camera(tool: Vector3, main: Camera, size: tuple[int, int]) -> Camera:
    """Return a camera near the hand, on the side of the camera of the film.

    Args:
        tool: position of the tool centre point in W, m.
        main: camera of the film.
        size: width and height, pixels.

    Returns:
        The camera.
    """
    x, y, z = tool
    turn = atan2(main.eye[1] - y, main.eye[0] - x)
    eye = (x + _CLOSE * cos(turn), y + _CLOSE * sin(turn), z + 0.6 * _CLOSE)
    width, height = size
    return Camera(eye, (x, y, z - 0.01), (0.0, 0.0, 1.0), _FIELD_OF_VIEW, width, height, far=40.0)


def _ball(recording: Recording, sample: PoseSample, near: float) -> _Ball:
    """Return the ball around the arm, and around people that are near it."""
    bx, by, bz = sample.base
    dx, dy = _facing(recording)
    x, y, z, radius = bx + 0.3 * dx, by + 0.3 * dy, bz + 0.22, _ARM_RADIUS
    height = radius
    for person in sample.people:
        away = hypot(person.x - bx, person.y - by)
        if away > near:
            continue
        px, py, pz, own = person.x, person.y, person.floor + person.height / 2.0, 0.55 * person.height
        gap = ((px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2) ** 0.5
        if gap + own > radius:
            wider = (gap + own + radius) / 2.0
            share = (wider - radius) / gap
            x, y, z, radius = x + share * (px - x), y + share * (py - y), z + share * (pz - z), wider
            height = max(height, own)
    return _Ball(x, y, z, radius, height)


def _facing(recording: Recording) -> tuple[float, float]:
    """Return the direction from the arm's base to what the scene's camera looks at, a unit vector."""
    (bx, by, _), (tx, ty, _) = recording.samples[0].base, recording.stage.view.target
    length = hypot(tx - bx, ty - by)
    return ((tx - bx) / length, (ty - by) / length) if length > 1e-3 else (1.0, 0.0)


def _azimuth(recording: Recording, samples: Sequence[PoseSample], near: float) -> float:
    """Choose the side from which a film is taken, rad: people stand beside the arm, and not before it."""
    view = recording.stage.view
    usual = atan2(view.eye[1] - view.target[1], view.eye[0] - view.target[0])
    ways = [
        (person.x - sample.base[0], person.y - sample.base[1])
        for sample in samples
        for person in sample.people
        if hypot(person.x - sample.base[0], person.y - sample.base[1]) < near
    ]
    if not ways:
        return usual
    towards = atan2(sum(y for _, y in ways), sum(x for x, _ in ways))
    sides = (towards + radians(72.0), towards - radians(72.0))
    return min(sides, key=lambda side: abs((side - usual + pi) % (2.0 * pi) - pi))


def _smoothed(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Return the running mean of rows, twice, so that the camera neither starts nor stops suddenly."""
    kernel = np.ones(window) / window
    for _ in range(2):
        padded = np.pad(values, ((window // 2, window - 1 - window // 2), (0, 0)), mode="edge")
        values = np.stack([np.convolve(column, kernel, mode="valid") for column in padded.T], axis=1)
    return values

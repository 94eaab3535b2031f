"""The figure of a person: head, trunk, arms and legs, which swing as the person walks."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, pi, sin
from typing import Final, NamedTuple

from aeros.runtime.ports import PersonFigure
from aeros.sim.geometry import UPRIGHT, Pose, Quaternion, compose
from aeros.sim.pictures.visual_shapes import VisualShape
from aeros.spec.model.scene import Colour

_HEIGHT: Final = 1.75
"""Height of the figure below, m."""

_STRIDE: Final = 1.5
"""Way that two steps lead, m."""

_SWING: Final = 0.45
"""Greatest angle of a leg while walking, rad."""

_TURNING: Final = 0.15
"""Share by which a figure turns to where it walks from picture to picture."""

_SKIN: Final[Colour] = (0.87, 0.68, 0.55)
_HAIR: Final[Colour] = (0.20, 0.14, 0.10)
_SHIRT: Final[Colour] = (0.16, 0.38, 0.62)
_TROUSERS: Final[Colour] = (0.20, 0.22, 0.27)
_SHOES: Final[Colour] = (0.10, 0.10, 0.11)


def _at(x: float, y: float, z: float) -> Pose:
    return Pose((x, y, z), UPRIGHT)


def _leg(side: float) -> tuple[VisualShape, ...]:
    return (
        VisualShape("capsule", (0.075, 0.33, 0.0), _TROUSERS, _at(0.0, side * 0.095, -0.22)),
        VisualShape("capsule", (0.058, 0.34, 0.0), _TROUSERS, _at(0.0, side * 0.095, -0.60)),
        VisualShape("ellipsoid", (0.27, 0.10, 0.10), _SHOES, _at(0.05, side * 0.095, -0.83)),
    )


def _arm(side: float) -> tuple[VisualShape, ...]:
    return (
        VisualShape("capsule", (0.046, 0.26, 0.0), _SHIRT, _at(0.0, side * 0.235, -0.14)),
        VisualShape("capsule", (0.037, 0.23, 0.0), _SKIN, _at(0.02, side * 0.245, -0.40)),
        VisualShape("sphere", (0.046, 0.0, 0.0), _SKIN, _at(0.03, side * 0.247, -0.56)),
    )


_TRUNK: Final = (
    VisualShape("ellipsoid", (0.24, 0.40, 0.62), _SHIRT, _at(0.0, 0.0, 1.17)),
    VisualShape("ellipsoid", (0.22, 0.36, 0.26), _TROUSERS, _at(0.0, 0.0, 0.92)),
    VisualShape(
        "capsule", (0.062, 0.30, 0.0), _SHIRT, Pose((0.0, 0.0, 1.39), (sin(pi / 4), 0.0, 0.0, cos(pi / 4)))
    ),
    VisualShape("capsule", (0.05, 0.08, 0.0), _SKIN, _at(0.0, 0.0, 1.48)),
    VisualShape("ellipsoid", (0.20, 0.165, 0.25), _SKIN, _at(0.015, 0.0, 1.625)),
    VisualShape("ellipsoid", (0.205, 0.18, 0.19), _HAIR, _at(-0.012, 0.0, 1.665)),
    VisualShape("ellipsoid", (0.03, 0.03, 0.045), _SKIN, _at(0.115, 0.0, 1.61)),
)

PERSON_PARTS: Final[tuple[tuple[VisualShape, ...], ...]] = (
    _TRUNK,
    _leg(1.0),
    _leg(-1.0),
    _arm(1.0),
    _arm(-1.0),
)
"""Shapes of trunk, legs and arms of a person 1.75 m high, each in its own frame: x ahead, z up."""

_JOINTS: Final = ((0.0, 0.0), (0.88, 1.0), (0.88, -1.0), (1.40, -0.8), (1.40, 0.8))
"""Height of the frame of each part above the floor, m, and the share and side with which it swings."""


class Stance(NamedTuple):
    """The posture of a person in a picture.

    Attributes:
        figure: where they are.
        heading: direction that they look in, rad about z of W.
        phase: of their steps, rad.
        pace: 0 of one who stands, 1 of one who walks.
    """

    figure: PersonFigure
    heading: float
    phase: float
    pace: float


def stances_of(pictures: Sequence[Sequence[PersonFigure]]) -> list[list[Stance]]:
    """Let people look and step where they walk.

    Args:
        pictures: the people in each picture; one that appears later is behind the others.

    Returns:
        Their stances in each picture.
    """
    stances: list[list[Stance]] = []
    first = _first_headings(pictures)
    for people in pictures:
        before = stances[-1] if stances else []
        stances.append(
            [
                _step(before[number], figure)
                if number < len(before)
                else Stance(figure, first[number], 0.0, 0.0)
                for number, figure in enumerate(people)
            ]
        )
    return stances


def _first_headings(pictures: Sequence[Sequence[PersonFigure]]) -> list[float]:
    """Return the direction in which each person walks first, rad."""
    headings: list[float] = []
    starts: list[PersonFigure] = []
    known: set[int] = set()
    for people in pictures:
        for number, figure in enumerate(people):
            if number >= len(starts):
                starts.append(figure)
                headings.append(0.0)
            dx, dy = figure.x - starts[number].x, figure.y - starts[number].y
            if number not in known and hypot(dx, dy) > 0.05:
                headings[number] = atan2(dy, dx)
                known.add(number)
    return headings


def _step(before: Stance, figure: PersonFigure) -> Stance:
    dx, dy = figure.x - before.figure.x, figure.y - before.figure.y
    way = hypot(dx, dy)
    walks = way > 1e-3
    pace = before.pace + 0.2 * ((1.0 if walks else 0.0) - before.pace)
    heading = before.heading
    if walks:
        turn = (atan2(dy, dx) - heading + pi) % (2.0 * pi) - pi
        heading += _TURNING * turn
    return Stance(figure, heading, before.phase + 2.0 * pi * way / _STRIDE, pace)


def part_poses(stance: Stance) -> list[Pose]:
    """Place the parts of a person.

    Args:
        stance: the posture.

    Returns:
        Pose in W of each of `PERSON_PARTS`.
    """
    figure, heading, phase, pace = stance
    frame = Pose((figure.x, figure.y, figure.floor), (0.0, 0.0, sin(heading / 2.0), cos(heading / 2.0)))
    scale = figure.height / _HEIGHT
    poses = []
    for height, share in _JOINTS:
        angle = _SWING * pace * share * sin(phase)
        turned: Quaternion = (0.0, sin(angle / 2.0), 0.0, cos(angle / 2.0))
        poses.append(compose(frame, Pose((0.0, 0.0, scale * height), turned)))
    return poses

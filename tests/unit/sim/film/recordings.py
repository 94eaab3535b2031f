"""A small recording: an arm, a box that appears, a person who walks up, and a layer that is wiped."""

from __future__ import annotations

from aeros.runtime.ports import PersonFigure
from aeros.sim.film.recording import Actor, CoatingFigure, PoseSample, Recording, RobotFigure, Stage
from aeros.sim.geometry import UPRIGHT, Camera, Pose
from aeros.sim.pictures.visual_shapes import VisualShape
from tests.unit.sim.robot.panda import PANDA

VIEW = Camera((1.5, 1.0, 0.9), (0.4, 0.0, 0.1))
HULLS = tuple((hull.link, hull.joint, tuple(hull.corners)) for hull in PANDA.body.hulls)
HAND = PANDA.hand
ROBOT = RobotFigure(
    "panda", tuple(PANDA.body.dh_rows), HULLS, HAND.flange, HAND.turn, HAND.tool, (0.5, 0.45, 0.28), "", ()
)
BOX = Actor("box", "", (VisualShape("box", (0.1, 0.1, 0.1), (0.8, 0.1, 0.1)),))
FLOOR = Actor("floor", "", (VisualShape("box", (4.0, 4.0, 0.05), (0.7, 0.7, 0.6)),))
DIRT = CoatingFigure((0.3, -0.1), (0.5, 0.1), 0.1, (0.3, 0.2, 0.1))
STAGE = Stage(
    VIEW,
    ROBOT,
    (BOX, FLOOR),
    {"dirt": DIRT},
    {"top": Camera((0.4, 0.0, 1.0), (0.4, 0.0, 0.0), (1.0, 0.0, 0.0))},
)
READY = (0.0, -0.7854, 0.0, -2.3562, 0.0, 1.5708, 0.7854)


def samples(count: int = 31, step: float = 1 / 30) -> list[PoseSample]:
    """Pictures of a person who walks along -x; the box appears in the second, dirt goes in the third."""
    return [
        PoseSample(
            round(number * step, 4),
            READY,
            (0.0, 0.0, 0.0),
            0.08,
            (0.3, 0.0, 0.48),
            {0: Pose((0.5, 0.0, 0.05), UPRIGHT) if number else None, 1: Pose((0.0, 0.0, -0.325), UPRIGHT)},
            (PersonFigure(round(2.0 - 0.04 * number, 4), 0.5, -0.3, 1.75, 0.25),),
            {"dirt": "1111" if number < 2 else "0010"},
        )
        for number in range(count)
    ]


def recording(count: int = 31) -> Recording:
    """The recording."""
    return Recording(STAGE, samples(count))

"""Motions of `aeros check-plant` on a real arm, which stands where it was left."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.runtime.ports import MotionCompletion, Plant
from aeros.skill import Action

WAIT: Final = 8.0
"""Time that the parallel action of the checks waits, s: the motion takes about two."""

_SPEED: Final = 0.15
"""Greatest speed of the tool, m/s."""

_LONGEST: Final = 60.0
"""Longest time for the way to the start, s."""


def move_joints(q: tuple[float, ...]) -> Action:
    """Make the action that moves the arm to a posture, slowly.

    Args:
        q: positions, rad.

    Returns:
        The action.
    """
    return Action("move_joints", {**{f"q{i}": value for i, value in enumerate(q, 1)}, "speed": _SPEED})


def open_at(open_plant: Callable[[], Plant], q: tuple[float, ...]) -> Plant:
    """Open a plant and move the arm to where the checks begin.

    Args:
        open_plant: opens the plant.
        q: positions, rad.

    Returns:
        The plant.

    Raises:
        RuntimeError: the arm does not get there.
    """
    plant = open_plant()
    try:
        _bring_to(plant, q)
    except BaseException:
        plant.close()
        raise
    return plant


def _bring_to(plant: Plant, q: tuple[float, ...]) -> None:
    motion = plant.begin(move_joints(q))
    if isinstance(motion, MotionCompletion):
        raise RuntimeError(f"the arm cannot go to the start of the checks: {motion.reason}")  # noqa: TRY004
    end = plant.advance(lambda time, values: None, plant.now() + _LONGEST).get(motion)
    if end is None or not end.completed:
        reason = f"it still moves after {_LONGEST:g} s" if end is None else end.reason
        raise RuntimeError(f"the arm did not get to the start of the checks: {reason}")

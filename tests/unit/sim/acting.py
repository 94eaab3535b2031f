"""Actions on a plant without gate or agent: monitors, and one action from its beginning to its end."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

from aeros.runtime.ports import Monitor, MotionCompletion, PlannedMotion, Plant
from aeros.skill import Action


def allow(now: float, values: Mapping[str, Any]) -> str | None:
    return None


def recording(log: list[Mapping[str, Any]]) -> Monitor:
    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        log.append(values)
        return None

    return monitor


def execute(
    plant: Plant, action: Action, monitor: Monitor, deadline: float, decided: PlannedMotion | None = None
) -> MotionCompletion:
    """Do `action` alone; where `deadline` comes first, it is halted."""
    motion = plant.begin(action, decided)
    if isinstance(motion, MotionCompletion):
        return motion
    ended = plant.advance(monitor, deadline)
    if ended:
        return ended[motion]
    plant.halt(motion)
    assert plant.advance(monitor, inf) == {motion: MotionCompletion(False, "halted")}
    return MotionCompletion(False, "deadline")

"""One action on a plant, from its beginning to its end: no gate, no agent."""

from __future__ import annotations

from math import inf

from aeros.runtime.ports import Completion, Monitor, Plan, Plant
from aeros.skill import Action


def execute(
    plant: Plant, action: Action, monitor: Monitor, deadline: float, decided: Plan | None = None
) -> Completion:
    """Do `action` alone; where `deadline` comes first, it is halted."""
    motion = plant.begin(action, decided)
    if isinstance(motion, Completion):
        return motion
    ended = plant.advance(monitor, deadline)
    if ended:
        return ended[motion]
    plant.halt(motion)
    assert plant.advance(monitor, inf) == {motion: Completion(False, "halted")}
    return Completion(False, "deadline")

"""Asks for motions at a speed that is no number."""

from aeros.skill import Inputs, Observation, SkillBody, act


def sweep(observed: Observation, inputs: Inputs) -> SkillBody:
    """Sweep at no speed at all."""
    for side in (0.2, -0.2, 0.2):
        yield act("move_tool", target=(0.62, side, 0.3), yaw=0.0, speed=float("nan"))

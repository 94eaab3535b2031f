"""Asks for motions that its envelope does not hold."""

from aeros.skill import Inputs, Observation, SkillBody, act


def sweep(observed: Observation, inputs: Inputs) -> SkillBody:
    """Sweep at whatever speed it is asked to."""
    for side in (0.2, -0.2, 0.2):
        yield act("move_tool", target=(0.62, side, 0.3), yaw=0.0, speed=inputs["speed"])

"""Presses as hard as a knife is pressed."""

from aeros.skill import Inputs, Observation, SkillBody, act


def cut(observed: Observation, inputs: Inputs) -> SkillBody:
    """Press down, and draw along."""
    yield act("move_tool", target=(0.45, 0.0, 0.1), yaw=0.0, speed=0.18)
    yield act("move_tool", target=(0.45, 0.0, 0.02), yaw=0.0, speed=0.1)
    yield act("slide", target=(0.45, -0.1, 0.013), force=inputs["force"], speed=0.05)

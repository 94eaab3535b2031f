"""Reaches and grips, slowly."""

from aeros.skill import Inputs, Observation, SkillBody, act


def work(observed: Observation, inputs: Inputs) -> SkillBody:
    """Reach about, and grip."""
    for side in (0.2, -0.2, 0.0):
        yield act("move_tool", target=(0.45, side, 0.3), yaw=0.0, speed=inputs["speed"])
    for turn in range(20):
        yield act("grip", width=0.06 + 0.01 * (turn % 2), force=10.0)

"""Look at the area, and hold the hand high over it."""

from aeros.skill import Inputs, Observation, SkillBody, act


def look(observed: Observation, inputs: Inputs) -> SkillBody:
    """Take a picture from above."""
    yield act("picture", camera="eye")


def rise(observed: Observation, inputs: Inputs) -> SkillBody:
    """Move the hand to the height that the operator set."""
    x, y, _ = observed["base_at"]
    speed = min(inputs["pace"], 0.19)
    yield act("go", target=(x + 0.45, y, inputs["height"]), yaw=0.0, speed=speed)

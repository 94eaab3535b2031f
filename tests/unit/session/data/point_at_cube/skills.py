"""Look at the table, and hold the hand over the cube."""

from aeros.skill import Inputs, Observation, SkillBody, act


def look(observed: Observation, inputs: Inputs) -> SkillBody:
    """Take a picture from above."""
    yield act("look", camera="overhead")


def hover(observed: Observation, inputs: Inputs) -> SkillBody:
    """Move the hand to 10 cm over the cube."""
    x, y, z = observed["cube_position"]
    yield act("move_tool", target=(x, y, 0.25), yaw=0.0, speed=0.25)
    yield act("move_tool", target=(x, y, z + 0.1), yaw=0.0, speed=0.1)

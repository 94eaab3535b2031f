"""Getting a table ready: most of what is done to it are skills of other modules."""

from aeros.skill import Inputs, Observation, SkillBody, act


def find_sponge(observed: Observation, inputs: Inputs) -> SkillBody:
    """Look for the sponge from above."""
    yield act("look", camera="overhead")

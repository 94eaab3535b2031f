"""Fill the kettle, and heat its water; what they did is measured by the perceiver."""

from aeros.skill import Inputs, Observation, SkillBody, act


def fill(observed: Observation, inputs: Inputs) -> SkillBody:
    """Look until the kettle is filled."""
    yield act("look", camera="overhead")


def heat(observed: Observation, inputs: Inputs) -> SkillBody:
    """Wait until the water is hot, for 20 s at most."""
    for _ in range(4):
        observed = yield act("wait", duration=5.0)
        if observed.get("water_hot", False):
            return
    yield act("look", camera="overhead")

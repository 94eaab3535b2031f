"""Ask a tool, and act on its answer."""

from aeros.skill import Inputs, Observation, SkillBody, act


def ask(observed: Observation, inputs: Inputs) -> SkillBody:
    """Ask how long 50 g of pork cook; without an answer there is nothing to wait for."""
    observed = yield act("cookbook", mass=0.05, filling="pork")
    if "cooking_time" in observed:
        yield act("wait", duration=min(observed["cooking_time"] - 0.001, 5.0))

"""Getting a table ready: what is done to it are skills of other modules."""

from aeros.skill import Inputs, Observation, SkillBody, act


def step_back(observed: Observation, inputs: Inputs) -> SkillBody:
    """Wait until the table is dry."""
    yield act("wait", duration=2.0)

from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("wait", duration=1.0)

from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    act("wait", duration=1.0)
    yield act("wait", duration=2.0)

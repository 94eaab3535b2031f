from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("move", target=(0.1, 0.0, 0.1), speed=0.001)

from aeros.skill import Inputs, Observation, SkillBody, act


def rest(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("wait", duration=1.0)

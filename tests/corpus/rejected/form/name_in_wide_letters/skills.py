from aeros.skill import Inputs, Observation, SkillBody, act


LIMIT = ｌｅｎ("a")


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("wait", duration=1.0)

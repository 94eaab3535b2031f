from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    rest()
    yield act("wait", duration=2.0)


def rest() -> SkillBody:
    yield act("wait", duration=1.0)

from aeros.skill import Observation, SkillBody, act


def tidy(observed: Observation) -> SkillBody:
    yield act("wait", duration=1.0)

from aeros.skill import Inputs, Observation, SkillBody, act


def ask(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("move", speed=0.2)

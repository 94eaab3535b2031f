from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("wipe", tool="sponge", pressure=1.0)

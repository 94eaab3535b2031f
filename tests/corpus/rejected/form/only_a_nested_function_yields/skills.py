from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> None:
    def inner() -> SkillBody:
        yield act("wait", duration=1.0)

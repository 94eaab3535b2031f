from aeros.skill import Inputs, Observation, SkillBody, act


def feed(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("feed", many=inputs["most"], speed=0.25)

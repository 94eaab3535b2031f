from aeros.skill import Inputs, Observation, SkillBody, act


def slowly(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("stop")


def quickly(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("stop")


def paced(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("carry", gait=inputs["limit"])

from aeros.skill import Inputs, Observation, SkillBody, act


def slowly(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("stop")


def quickly(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("sweep", tool="brush", wet=False, pace=0.5)


def paced(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("carry", gait=inputs["limit"])

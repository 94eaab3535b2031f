from aeros.skill import Inputs, Observation, SkillBody, act


def rest(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("wait", duration=1.0)


def roll(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("spin", pace_of_turn=0.1)


def sweep(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("sweep", rate=0.1)

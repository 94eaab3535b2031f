from aeros.perception import Perception, View
from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("approach", pace=0.05)


def see(view: View) -> Perception:
    while True:
        yield {"clean": True}

from aeros.skill import Inputs, Observation, SkillBody

from .motions import draw_near


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield from draw_near()

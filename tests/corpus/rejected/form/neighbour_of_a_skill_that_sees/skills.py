from aeros.skill import Inputs, Observation, SkillBody, act

from .shades import DARK


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("approach", pace=0.05)


LEVEL = DARK / 255

from dataclasses import dataclass

from aeros.skill import Inputs, Observation, SkillBody, act


@dataclass(init=False, eq=False)
class Shape:
    x = 0
    __annotations__ = {"x or exit()": int}


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("wait", duration=1.0)

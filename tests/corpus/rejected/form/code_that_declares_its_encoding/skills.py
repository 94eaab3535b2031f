# -*- coding: latin-1 -*-
from aeros.skill import Inputs, Observation, SkillBody, act


LIMIT = len("a")


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("wait", duration=1.0)

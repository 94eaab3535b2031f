from __future__ import annotations

from aeros.skill import Inputs, Models, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs, models: Models) -> SkillBody:
    seconds = models["patience"].run(dirt=0.2)["duration"]
    yield act("wait", duration=seconds)

"""Changes an action after it has asked for it."""

from __future__ import annotations

from aeros.skill import Action, Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    parameters = {"speed": 0.1}
    yield Action("ask", parameters)
    parameters["speed"] = 9.0
    yield act("ask", speed=0.2)

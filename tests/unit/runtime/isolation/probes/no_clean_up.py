"""Does not let itself be closed."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    while True:
        try:
            yield act("ask")
        except GeneratorExit:
            pass

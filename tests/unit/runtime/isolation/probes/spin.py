"""Computes for ever."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    while True:
        pass
    yield act("never")

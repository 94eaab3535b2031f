"""Keeps more and more."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    kept = []
    while True:
        kept.append(bytearray(1 << 20))
    yield act("never")

"""Fails in a million words, some of which are no characters."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    raise ValueError("\ud800" + "word " * 200_000)
    yield act("never")

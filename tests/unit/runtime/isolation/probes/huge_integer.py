"""Asks with an integer of a thousand digits."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("ask", count=10**1000)

"""Asks with a list that contains itself."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    endless: list[object] = []
    endless.append(endless)
    yield act("ask", target=endless)

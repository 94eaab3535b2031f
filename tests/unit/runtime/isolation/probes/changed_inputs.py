"""Changes the inputs that the gate judges by."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    inputs["address"] = 0
    yield act("ask", address=inputs["address"])

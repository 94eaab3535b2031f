"""Asks with what is no number."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("ask", a=float("nan"), b=float("inf"), c=-0.0, d=5e-324)

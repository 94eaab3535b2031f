"""Asks the interpreter to end."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    raise SystemExit(0)
    yield act("never")

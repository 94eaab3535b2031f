"""Pretends that the user pressed Ctrl-C."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    raise KeyboardInterrupt
    yield act("never")

"""The tests say what each skill asks for; this is only there to be pointed at."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def ask(observed: Observation, inputs: Inputs) -> SkillBody:
    """Wait."""
    yield act("wait", duration=1.0)

"""Skills of the module of the examples in docs/codes."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def pick_cloth(observed: Observation, inputs: Inputs) -> SkillBody:
    """Close the fingers."""
    yield act("grip", force=8.0)


def wipe(observed: Observation, inputs: Inputs) -> SkillBody:
    """Move across the bench."""
    yield act("move", target=[0.3, 0.1, 0.05], speed=0.2)


def rest(observed: Observation, inputs: Inputs) -> SkillBody:
    """Wait."""
    yield act("wait", duration=1.0)

"""Yields something else."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield {"kind": "ask"}

"""Ends its process."""

from __future__ import annotations

import os

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    os._exit(3)
    yield act("never")

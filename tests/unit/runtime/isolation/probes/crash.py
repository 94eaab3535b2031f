"""Reads where there is nothing."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    ctypes.string_at(0)
    yield act("never")

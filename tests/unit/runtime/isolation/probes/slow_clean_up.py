"""Cleans up for ever."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    try:
        yield act("ask")
    finally:
        while True:
            pass

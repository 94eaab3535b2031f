"""Calls itself until there is no stack."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    def fall() -> None:
        fall()

    fall()
    yield act("never")

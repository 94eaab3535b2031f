"""Computes for ever where no signal handler of Python's runs."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("never", value=pow(7, 10**9, 10**9 + 7) and sum(range(10**12)))

"""Asks with a megabyte of text."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("ask", side="x" * 1_000_000)

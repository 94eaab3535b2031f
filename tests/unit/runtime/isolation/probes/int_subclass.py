"""Asks with an integer that compares as it likes."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


class Few(int):
    def __le__(self, other: object) -> bool:
        return True


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("ask", count=Few(9))

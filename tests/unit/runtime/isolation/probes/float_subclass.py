"""Asks with a float that compares as it likes."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


class Slow(float):
    def __le__(self, other: object) -> bool:
        return True

    __lt__ = __ge__ = __gt__ = __eq__ = __le__
    __hash__ = float.__hash__


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("ask", speed=Slow(9.0))

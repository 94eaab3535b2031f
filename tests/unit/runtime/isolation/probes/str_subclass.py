"""Asks with a text that is equal to every text."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act


class Any_(str):
    def __eq__(self, other: object) -> bool:
        return True

    __hash__ = str.__hash__


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("ask", side=Any_("left"))

"""Yields parameters that differ each time they are read."""

from __future__ import annotations

from aeros.skill import Action, Inputs, Observation, SkillBody


class Shifting(dict[str, float]):
    def items(self) -> object:
        return [("speed", 9.0)]


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield Action("ask", Shifting(speed=0.1))

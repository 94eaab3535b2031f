"""Yields an action of a class of its own."""

from __future__ import annotations

from aeros.skill import Action, Inputs, Observation, SkillBody


class Forged(Action):
    @property
    def kind(self) -> str:
        return "stop"


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield Forged("ask", {})

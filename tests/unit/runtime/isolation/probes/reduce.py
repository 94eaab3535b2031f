"""Asks with an object that would run a command when it is unpickled."""

from __future__ import annotations

import os

from aeros.skill import Inputs, Observation, SkillBody, act


class Bomb:
    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[object, ...]:
        return os.system, (f"touch {self.folder}/unpickled",)


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("ask", speed=Bomb(inputs["folder"]))

"""Sleeps for ever."""

from __future__ import annotations

import time

from aeros.skill import Inputs, Observation, SkillBody, act


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    while True:
        time.sleep(1000)
    yield act("never")

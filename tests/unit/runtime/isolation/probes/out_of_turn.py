"""Says that it is loaded when it is asked for an action."""

from __future__ import annotations

import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import question, send


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    send({"type": "SkillLoaded", "token": question().token})
    time.sleep(60)
    yield act("never")

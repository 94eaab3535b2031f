"""Asks for an action with a thousand parameters."""

from __future__ import annotations

import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import question, send


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    send(
        {
            "type": "ActionRequested",
            "token": question().token,
            "kind": "ask",
            "parameters": {f"p{i}": i for i in range(1000)},
        }
    )
    time.sleep(60)
    yield act("never")

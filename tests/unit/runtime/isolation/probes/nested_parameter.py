"""Asks for an action with lists in a list."""

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
            "parameters": {"target": [[0.1]]},
        }
    )
    time.sleep(60)
    yield act("never")

"""Answers the second question with its answer to the first."""

from __future__ import annotations

import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import question, send


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    first = question().token
    yield act("ask")
    send({"type": "ActionRequested", "token": first, "kind": "ask", "parameters": {}})
    time.sleep(60)
    yield act("never")

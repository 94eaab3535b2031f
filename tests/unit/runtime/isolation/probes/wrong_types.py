"""Answers with a kind that is a number and parameters that are bytes."""

from __future__ import annotations

import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import question, send


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    send({"type": "ActionRequested", "token": question().token, "kind": 7, "parameters": b"speed"})
    time.sleep(60)
    yield act("never")

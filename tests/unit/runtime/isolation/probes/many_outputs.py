"""Ends with a thousand outputs, past the worker's own check of them."""

from __future__ import annotations

import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import question, send


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    send({"type": "SkillFinished", "token": question().token, "outputs": {f"o{i}": i for i in range(1000)}})
    time.sleep(60)
    yield act("never")

"""Answers a question before it was asked."""

from __future__ import annotations

import os
import time

from aeros.runtime.isolation.protocol import ActionRequested, encode
from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import channel, question


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    yield_first = encode(ActionRequested(question().token, "ask", {}))
    guess = encode(ActionRequested(bytes(16), "ask", {}))
    os.write(channel(), yield_first)
    time.sleep(0.2)
    os.write(channel(), guess)
    time.sleep(60)
    yield act("never")

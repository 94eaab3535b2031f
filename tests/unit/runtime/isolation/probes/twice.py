"""Answers one question twice."""

from __future__ import annotations

import os
import time

from aeros.runtime.isolation.protocol import ActionRequested, encode
from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import channel, question


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    frame = encode(ActionRequested(question().token, "ask", {}))
    os.write(channel(), frame + frame)
    time.sleep(60)
    yield act("never")

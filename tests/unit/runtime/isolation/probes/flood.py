"""Says more than it was asked, without end."""

from __future__ import annotations

import os

from aeros.runtime.isolation.protocol import ActionRequested, encode
from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import channel, question


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    frame = encode(ActionRequested(question().token, "ask", {}))
    while True:
        os.write(channel(), frame * 100)
    yield act("never")

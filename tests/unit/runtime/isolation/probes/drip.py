"""Answers a byte at a time, so that there is always something to hear."""

from __future__ import annotations

import os
import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import channel


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    os.write(channel(), (60_000).to_bytes(4, "big"))
    while True:
        os.write(channel(), b"x")
        time.sleep(0.05)
    yield act("never")

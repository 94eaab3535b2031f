"""Answers with lists in lists in lists."""

from __future__ import annotations

import os
import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import channel


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    os.write(channel(), (60_000).to_bytes(4, "big") + b"\x91" * 60_000)
    time.sleep(60)
    yield act("never")

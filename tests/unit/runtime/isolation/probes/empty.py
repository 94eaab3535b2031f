"""Answers with nothing."""

from __future__ import annotations

import os
import time

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.isolation.support.hostile import channel


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    os.write(channel(), b"\0\0\0\0")
    time.sleep(60)
    yield act("never")

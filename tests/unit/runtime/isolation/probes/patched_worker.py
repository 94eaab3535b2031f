"""Replaces the worker's own functions."""

from __future__ import annotations

import aeros.runtime.isolation.worker as worker
from aeros.skill import Inputs, Observation, SkillBody, act


class F(float):
    pass


def probe(observed: Observation, inputs: Inputs) -> SkillBody:
    worker.copy_action = lambda yielded: act("ask", speed=F(9.0))
    yield act("ask", speed=0.1)

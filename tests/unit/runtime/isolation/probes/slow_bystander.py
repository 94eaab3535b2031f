"""Slows another process down."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.setpriority(os.PRIO_PROCESS, inputs["victim"], 19)
    return "slowed"

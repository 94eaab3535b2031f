"""Finds the runtime's process, by a signal that does nothing."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.kill(inputs["runtime"], 0)
    return "found"

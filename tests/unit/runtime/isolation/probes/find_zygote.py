"""Finds its parent, by a signal that does nothing."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.kill(os.getppid(), 0)
    return "found"

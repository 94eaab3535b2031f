"""Kills a process that has nothing to do with it."""

from __future__ import annotations

import os
import signal

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.kill(inputs["victim"], signal.SIGKILL)
    return "killed"

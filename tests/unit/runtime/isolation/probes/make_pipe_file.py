"""Makes a named pipe, through which another process could be spoken to."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.mkfifo(inputs["folder"] + "/pipe")
    return "made"

"""Lists a folder of the host."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return os.listdir(inputs["folder"])

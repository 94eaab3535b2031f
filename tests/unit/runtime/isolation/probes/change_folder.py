"""Changes its working folder."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.chdir(inputs["folder"])
    return "changed"

"""Makes a folder."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.mkdir(inputs["folder"] + "/made")
    return "made"

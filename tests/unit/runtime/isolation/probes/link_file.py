"""Links to a file of the host."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.symlink(inputs["canary"], inputs["folder"] + "/link")
    return "linked"

"""Opens a file of the host to everybody."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.chmod(inputs["canary"], 0o777)
    return "changed"

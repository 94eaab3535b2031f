"""Starts another program."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return os.posix_spawn("/bin/true", ["true"], {})

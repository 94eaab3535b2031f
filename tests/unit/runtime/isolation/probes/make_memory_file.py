"""Makes a file that is in memory alone."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return os.memfd_create("hidden")

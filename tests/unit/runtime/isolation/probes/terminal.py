"""Writes to the terminal."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.write(1, b"from a skill\n")
    os.write(2, b"from a skill\n")
    raise PermissionError("nobody sees it")

"""Becomes another user."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.setuid(1)
    return os.getuid()

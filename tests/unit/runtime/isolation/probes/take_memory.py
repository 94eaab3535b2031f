"""Takes a gigabyte."""

from __future__ import annotations

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return len(bytearray(1 << 30))

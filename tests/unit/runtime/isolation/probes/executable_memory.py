"""Asks for memory into which it could write machine code."""

from __future__ import annotations

import mmap

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return len(mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC))

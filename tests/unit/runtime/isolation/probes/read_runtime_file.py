"""Reads the runtime's memory through its file."""

from __future__ import annotations

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with open(f"/proc/{inputs['runtime']}/mem", "rb", 0) as memory:
        memory.seek(inputs["address"])
        return memory.read(16)

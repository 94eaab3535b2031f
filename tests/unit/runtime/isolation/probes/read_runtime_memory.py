"""Reads the runtime's memory by system call."""

from __future__ import annotations

from aeros.skill import Inputs
from tests.unit.runtime.isolation.support.hostile import other_memory


def attack(inputs: Inputs) -> object:
    return other_memory("process_vm_readv", inputs["runtime"], inputs["address"])

"""Attaches to another process as its debugger."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    library = ctypes.CDLL(None, use_errno=True)
    if library.ptrace(0x4206, inputs["victim"], 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "ptrace")
    return "attached"

"""Kills a process past the C library."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    if ctypes.CDLL(None).syscall(62, inputs["victim"], 9) != 0:
        raise PermissionError("kill")
    return "killed"

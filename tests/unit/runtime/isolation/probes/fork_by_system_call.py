"""Forks past the C library."""

from __future__ import annotations

import ctypes
import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    child = ctypes.CDLL(None).syscall(56, 17, 0, 0, 0, 0)
    if child == 0:
        os._exit(0)
    if child < 0:
        raise PermissionError("clone")
    return child

"""Leaves a key in the kernel for its next invocation."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    library = ctypes.CDLL(None, use_errno=True)
    if library.syscall(248, b"user", b"aeros-probe", b"memory", 6, -1) < 0:
        raise OSError(ctypes.get_errno(), "add_key")
    return "kept"

"""Asks for a ring through which the kernel does what it may not ask for itself."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    library = ctypes.CDLL(None, use_errno=True)
    if library.syscall(425, 4, ctypes.create_string_buffer(120)) < 0:
        raise OSError(ctypes.get_errno(), "io_uring_setup")
    return "ring"

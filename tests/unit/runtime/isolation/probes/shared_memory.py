"""Leaves a segment of shared memory for its next invocation."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    library = ctypes.CDLL(None, use_errno=True)
    if (segment := library.shmget(0, 4096, 0o1600)) < 0:
        raise OSError(ctypes.get_errno(), "shmget")
    library.shmctl(segment, 0, None)
    return segment

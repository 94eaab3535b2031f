"""Writes into the runtime's memory by system call."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    class Vector(ctypes.Structure):
        _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))

    library = ctypes.CDLL(None, use_errno=True)
    mine = ctypes.create_string_buffer(b"overwritten", 16)
    local = Vector(ctypes.addressof(mine), 6)
    remote = Vector(inputs["address"], 6)
    if library.process_vm_writev(inputs["runtime"], ctypes.byref(local), 1, ctypes.byref(remote), 1, 0) != 6:
        raise OSError(ctypes.get_errno(), "process_vm")
    return mine.value

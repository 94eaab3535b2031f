"""Mounts a file system over a folder of the host."""

from __future__ import annotations

import ctypes

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    library = ctypes.CDLL(None, use_errno=True)
    if library.mount(b"none", inputs["folder"].encode(), b"tmpfs", 0, None) != 0:
        raise OSError(ctypes.get_errno(), "mount")
    library.umount(inputs["folder"].encode())
    return "mounted"

"""Import PyBullet, at this one place, without the banner that it prints on import.

The library prints the banner through C's standard output or standard error, depending on its build, where it
would mix with a command's output.
"""

from __future__ import annotations

import ctypes
import os

_stdout, _stderr, _nowhere = os.dup(1), os.dup(2), os.open(os.devnull, os.O_WRONLY)
try:
    os.dup2(_nowhere, 1)
    os.dup2(_nowhere, 2)
    import pybullet as bullet
    import pybullet_data

    ctypes.CDLL(None).fflush(None)
finally:
    os.dup2(_stdout, 1)
    os.dup2(_stderr, 2)
    for _opened in (_stdout, _stderr, _nowhere):
        os.close(_opened)

DATA: str = pybullet_data.getDataPath()
"""Folder of the models that come with PyBullet."""

__all__ = ["DATA", "bullet"]

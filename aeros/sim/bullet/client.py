"""Import PyBullet, at this one place, without the banner that it prints on import.

The library prints the banner through C's standard output or standard error, depending on its build, where it
would mix with a command's output.
"""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress

_saved: dict[int, int] = {}
for _stream in (1, 2):
    with suppress(OSError):  # it is closed, and stays so
        _saved[_stream] = os.dup(_stream)
_nowhere = os.open(os.devnull, os.O_WRONLY)
try:
    for _stream in _saved:
        os.dup2(_nowhere, _stream)
    import pybullet as bullet
    import pybullet_data

    ctypes.CDLL(None).fflush(None)
finally:
    for _stream, _copy in _saved.items():
        os.dup2(_copy, _stream)
    for _opened in (*_saved.values(), _nowhere):
        os.close(_opened)

DATA: str = pybullet_data.getDataPath()
"""Folder of the models that come with PyBullet."""

__all__ = ["DATA", "bullet"]

"""System calls that Python's library lacks, by way of libc; a failed one is an OSError."""

from __future__ import annotations

import ctypes
import os
from typing import Any

_LIBC = ctypes.CDLL(None, use_errno=True)


def system_call(number: int, *arguments: Any) -> int:
    """The result of system call `number`."""
    # Varargs are passed as C ints unless told otherwise, which would cut pointers in half.
    return _check_result(_LIBC.syscall(ctypes.c_long(number), *map(_to_long, arguments)))


def process_control(option: int, *arguments: Any) -> int:
    """The result of `prctl`."""
    return _check_result(_LIBC.prctl(ctypes.c_int(option), *map(_to_long, (*arguments, 0, 0, 0, 0)[:4])))


def _to_long(argument: Any) -> Any:
    return ctypes.c_long(argument) if isinstance(argument, int) else argument


def _check_result(result: int) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return result

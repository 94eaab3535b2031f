"""System calls that Python's library lacks, through libc; a failed call raises OSError."""

from __future__ import annotations

import ctypes
import os
from typing import Any

_LIBC = ctypes.CDLL(None, use_errno=True)


def system_call(number: int, *arguments: Any) -> int:
    """Make a system call.

    Args:
        number: number of the call on this architecture.
        arguments: integers, or objects that ctypes can pass.

    Returns:
        The result, not negative.

    Raises:
        OSError: the call failed.
    """
    # Varargs would be passed as C ints by default, which would cut pointers in half.
    return _check_result(_LIBC.syscall(ctypes.c_long(number), *map(_to_long, arguments)))


def process_control(option: int, *arguments: Any) -> int:
    """Call `prctl`.

    Args:
        option: the operation.
        arguments: up to four; missing ones are 0.

    Returns:
        The result, not negative.

    Raises:
        OSError: the call failed.
    """
    return _check_result(_LIBC.prctl(ctypes.c_int(option), *map(_to_long, (*arguments, 0, 0, 0, 0)[:4])))


def _to_long(argument: Any) -> Any:
    return ctypes.c_long(argument) if isinstance(argument, int) else argument


def _check_result(result: int) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return result

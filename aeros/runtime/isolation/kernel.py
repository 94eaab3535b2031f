"""System calls that Python's library lacks, through libc; and the descendants of a process, from `/proc`."""

from __future__ import annotations

import ctypes
import os
import signal
import time
from contextlib import suppress
from pathlib import Path
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


def child_processes(pid: int | None = None) -> list[int]:
    """List the children of a process.

    Args:
        pid: the process; None for this one.

    Returns:
        Their process ids; empty if the process has ended.
    """
    files = Path(f"/proc/{'self' if pid is None else pid}/task").glob("*/children")
    found: list[int] = []
    for file in files:
        with suppress(FileNotFoundError, ProcessLookupError):  # the thread has ended
            found += map(int, file.read_text(encoding="ascii").split())
    return found


def end_descendants() -> None:
    """Kill descendants until none is left; orphans of a killed process become children, to be killed next.

    This process must be a subreaper (`become_subreaper`).
    """
    while True:
        try:
            reaped, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if reaped == 0:
            for child in child_processes():
                with suppress(ProcessLookupError):
                    os.kill(child, signal.SIGKILL)
            time.sleep(0.0005)


def _to_long(argument: Any) -> Any:
    return ctypes.c_long(argument) if isinstance(argument, int) else argument


def _check_result(result: int) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return result

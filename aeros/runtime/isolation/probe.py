"""Each layer is probed by what it does: something is tried, the layer put on, the same tried again.

A layer is there when what worked before works no longer.  What the kernel says it supports is not
asked: container runtimes and security modules filter system calls, and then say one thing and do another.
"""

from __future__ import annotations

import mmap
import os
import socket
from collections.abc import Callable
from typing import Final

from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.limits import MEMORY
from aeros.runtime.isolation.privileges import drop_privileges

_MAX_TEXT_LENGTH: Final = 500


def _open_a_file() -> None:
    os.close(os.open("/proc/self/statm", os.O_RDONLY))


def _make_a_socket() -> None:
    socket.socket(socket.AF_INET, socket.SOCK_DGRAM).close()


def _map_executable_memory() -> None:
    mmap.mmap(-1, mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_EXEC).close()


def _allocate_memory() -> None:
    bytearray(MEMORY + MEMORY // 2)


_LAYER_ATTEMPTS: Final[dict[IsolationLayer, tuple[Callable[[], None], ...]]] = {
    IsolationLayer.RLIMITS: (_allocate_memory,),
    IsolationLayer.LANDLOCK: (_open_a_file,),
    IsolationLayer.SECCOMP: (_make_a_socket, _map_executable_memory),
}


def probe_layer(layer: IsolationLayer) -> str | None:
    """Why `layer` is missing here, tried in a process forked for it; None if it is there.

    layer: one that a worker puts on by itself.
    """
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            found = _missing_reason(layer) or ""
            os.write(write_end, found.encode("utf-8", "replace")[:_MAX_TEXT_LENGTH])
            os._exit(0)
        finally:
            os._exit(1)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        said = pipe.read().decode("utf-8", "replace")
    _, status = os.waitpid(child, 0)
    if status != 0:
        return f"its probe ended with {os.waitstatus_to_exitcode(status)}"
    return said or None


def probe_sandbox(runtime_pid: int, path: str, address: str) -> str | None:
    """Why this process is not closed off from the runtime's surroundings; None if it is.

    runtime_pid: the runtime's process.  path: a file of it.  address: a UNIX socket in the abstract
        namespace on which it listens, which belongs to its network.
    """
    if _attempt_succeeds(lambda: os.kill(runtime_pid, 0)):
        return "the runtime's process can be seen"
    if _attempt_succeeds(lambda: os.close(os.open(path, os.O_RDONLY))):
        return "the runtime's files can be opened"
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        if _attempt_succeeds(lambda: client.connect(f"\0{address}")):
            return "the runtime's network can be reached"
    return None


def _missing_reason(layer: IsolationLayer) -> str | None:
    for one in _LAYER_ATTEMPTS[layer]:
        one()
    try:
        drop_privileges()
        APPLY_LAYER[layer]()
    except OSError as failure:
        return str(failure)
    if any(_attempt_succeeds(one) for one in _LAYER_ATTEMPTS[layer]):
        return "it was put on and has no effect"
    return None


def _attempt_succeeds(attempt: Callable[[], None]) -> bool:
    try:
        attempt()
    except (OSError, MemoryError):
        return False
    return True

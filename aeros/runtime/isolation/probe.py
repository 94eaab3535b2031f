"""Probes of isolation layers: try something, apply the layer, try the same again.

A layer is in place if what worked before fails afterwards. The kernel is not asked what it supports:
container runtimes and security modules filter system calls, so its answer may differ from its behaviour.
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


def _map_much_memory() -> None:
    # Mapped, not written: to fill it would take 0.1 s.
    mmap.mmap(-1, MEMORY + MEMORY // 2).close()


_LAYER_ATTEMPTS: Final[dict[IsolationLayer, tuple[Callable[[], None], ...]]] = {
    IsolationLayer.RLIMITS: (_map_much_memory,),
    IsolationLayer.LANDLOCK: (_open_a_file,),
    IsolationLayer.SECCOMP: (_make_a_socket, _map_executable_memory),
}


def probe_layer(layer: IsolationLayer) -> str | None:
    """Probe a layer in a process forked for it.

    Args:
        layer: one that a worker applies to itself.

    Returns:
        Why the layer is missing here; None if it is in place.
    """
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            reason = _missing_reason(layer) or ""
            os.write(write_end, reason.encode("utf-8", "replace")[:_MAX_TEXT_LENGTH])
            os._exit(0)
        finally:
            os._exit(1)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        reason = pipe.read().decode("utf-8", "replace")
    _, status = os.waitpid(child, 0)
    if status != 0:
        return f"its probe ended with {os.waitstatus_to_exitcode(status)}"
    return reason or None


def probe_sandbox(runtime_pid: int, path: str, address: str) -> str | None:
    """Probe this process's separation from the runtime's surroundings.

    Args:
        runtime_pid: id of the runtime's process.
        path: a file of the runtime.
        address: abstract UNIX socket on which the runtime listens, in its network namespace.

    Returns:
        What can still be reached; None if nothing can.
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
    for attempt in _LAYER_ATTEMPTS[layer]:
        attempt()
    try:
        drop_privileges()
        APPLY_LAYER[layer]()
    except OSError as failure:
        return str(failure)
    if any(_attempt_succeeds(attempt) for attempt in _LAYER_ATTEMPTS[layer]):
        return "it was applied and has no effect"
    return None


def _attempt_succeeds(attempt: Callable[[], None]) -> bool:
    try:
        attempt()
    except (OSError, MemoryError):
        return False
    return True

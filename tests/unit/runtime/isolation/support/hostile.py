"""Means of hostile code: the question it is to answer, its channel, and the memory of others."""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Any

import msgspec


def _found(name: str, holder: str) -> Any:
    frame = sys._getframe(1)
    while frame.f_code.co_name != holder and frame.f_back is not None:
        frame = frame.f_back
    return frame.f_locals[name]


def question() -> Any:
    return _found("question", "handle")


def channel() -> int:
    return int(_found("channel", "serve"))


def send(frame: dict[str, Any]) -> None:
    payload = msgspec.msgpack.encode(frame)
    os.write(channel(), len(payload).to_bytes(4, "big") + payload)


def other_memory(call: str, runtime: int, address: int) -> bytes:
    """Let the system call `call` copy between a buffer, which is returned, and the runtime's memory."""

    class Vector(ctypes.Structure):
        _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))

    mine = ctypes.create_string_buffer(b"overwritten", 16)
    local, remote = Vector(ctypes.addressof(mine), 6), Vector(address, 6)
    copy = getattr(ctypes.CDLL(None, use_errno=True), call)
    if copy(runtime, ctypes.byref(local), 1, ctypes.byref(remote), 1, 0) != 6:
        raise OSError(ctypes.get_errno(), "process_vm")
    return mine.value

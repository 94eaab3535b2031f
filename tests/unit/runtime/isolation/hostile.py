"""What hostile code finds in its worker: the question it is to answer, and the channel to answer on."""

from __future__ import annotations

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
    return _found("question", "answer")


def channel() -> int:
    return int(_found("channel", "serve"))


def send(frame: dict[str, Any]) -> None:
    payload = msgspec.msgpack.encode(frame)
    os.write(channel(), len(payload).to_bytes(4, "big") + payload)

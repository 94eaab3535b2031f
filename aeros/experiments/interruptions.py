"""Ctrl-C while a pool of processes is used: counted, and looked at where it is safe."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Self


class InterruptCounter:
    """How often SIGINT came as long as this is entered, by the main thread; where it is ignored, it still is.

    An exception in its place may come between any two instructions, as where a lock that is shared with the
    pool's thread is taken and not yet noted as taken.  Nobody would ever free it, and who waits for that
    thread waits for ever.
    """

    def __init__(self) -> None:
        self.count = 0

    def __enter__(self) -> Self:
        self._former = signal.getsignal(signal.SIGINT)
        if self._former is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, self._on_sigint)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._former)

    def _on_sigint(self, _number: int, _frame: FrameType | None) -> None:
        self.count += 1

"""Counter of Ctrl-C while a pool of processes is used: it is acted on where that is safe."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Self


class InterruptCounter:
    """Counter of SIGINT in the main thread while this context is entered; a SIGINT that is ignored stays so.

    An exception instead could come between any two instructions, for instance just after this thread acquired
    a lock that it shares with the pool's thread, and before it noted that.  Nobody would ever release that
    lock, and a thread that waits for it would wait forever.
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

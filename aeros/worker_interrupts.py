"""Ctrl-C while worker processes start: held back until they handle it, so that none shows a traceback."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_INTERRUPT: Final = frozenset({signal.SIGINT})


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Hold SIGINT back in this thread, and in processes that are started meanwhile; it is delivered after.

    Yields:
        Nothing; start the processes here. Each of them calls `set_interrupt_handler` first.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _INTERRUPT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def set_interrupt_handler(handler: signal.Handlers) -> None:
    """Set how a worker process handles SIGINT, and let it be delivered.

    Args:
        handler: `SIG_IGN` or `SIG_DFL`.
    """
    signal.signal(signal.SIGINT, handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _INTERRUPT)

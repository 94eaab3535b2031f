"""Ctrl-C while worker processes start: held back until they handle it, so that none shows a traceback."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_INTERRUPT: Final = frozenset({signal.SIGINT})


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Hold SIGINT back in this thread, and in processes that are started meanwhile; it is delivered after.

    The mask is what started processes inherit. It is a mask of one thread: where a library runs threads of
    its own, the system may deliver the signal to one of those, and Python then runs the handler in the main
    thread. So the main thread also has a handler meanwhile that only notes the signal.

    Yields:
        Nothing; start the processes here. Each of them calls `set_interrupt_handler` first.
    """
    noted: list[int] = []
    handler = signal.getsignal(signal.SIGINT)
    notes = callable(handler) and threading.current_thread() is threading.main_thread()
    # Set first and reset last, so that nothing is raised between both changes of the mask.
    if notes:
        signal.signal(signal.SIGINT, lambda number, _frame: noted.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _INTERRUPT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if notes:
            signal.signal(signal.SIGINT, handler)
        if noted:
            signal.raise_signal(signal.SIGINT)


def set_interrupt_handler(handler: signal.Handlers) -> None:
    """Set how a worker process handles SIGINT, and let it be delivered.

    Args:
        handler: `SIG_IGN` or `SIG_DFL`.
    """
    signal.signal(signal.SIGINT, handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _INTERRUPT)

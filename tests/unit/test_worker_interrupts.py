"""Ctrl-C is held back while worker processes start, and none of them shows a traceback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from aeros.worker_interrupts import deferred_interrupts, set_interrupt_handler

CHILD = """
import signal, sys, time
time.sleep(0.3)  # as long as imports take
from aeros.worker_interrupts import set_interrupt_handler
print("begins", flush=True)
set_interrupt_handler(signal.{handler})
time.sleep(0.2)
print("goes on")
"""


@pytest.mark.parametrize(
    ("handler", "out", "code"), [("SIG_IGN", "begins\ngoes on\n", 0), ("SIG_DFL", "begins\n", -2)]
)
def test_a_process_that_is_interrupted_while_it_imports_shows_no_traceback(
    handler: str, out: str, code: int
) -> None:
    with deferred_interrupts():
        child = subprocess.Popen(
            [sys.executable, "-c", CHILD.format(handler=handler)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    time.sleep(0.1)
    child.send_signal(signal.SIGINT)
    shown, errors = child.communicate(timeout=30)
    assert (shown, errors, child.returncode) == (out, "", code)


@pytest.mark.parametrize("with_threads", [False, True])
def test_an_interrupt_is_delivered_after(with_threads: bool) -> None:
    """Also where other threads, which hold no signal back, can receive it for the process."""
    held = []
    ended = threading.Event()
    others = [threading.Thread(target=ended.wait) for _ in range(4 if with_threads else 0)]
    for other in others:
        other.start()
    former = signal.signal(signal.SIGINT, lambda *_: held.append("delivered"))
    try:
        with deferred_interrupts():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)
            held.append("held back")
        assert held == ["held back", "delivered"]
        set_interrupt_handler(signal.SIG_IGN)
        os.kill(os.getpid(), signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, former)
        ended.set()
        for other in others:
            other.join()
    assert held == ["held back", "delivered"]


def test_an_interrupt_between_the_changes_of_handler_and_mask_is_held_back_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    change_mask = signal.pthread_sigmask

    def interrupted(how: signal.Sigmasks, mask: set[signal.Signals]) -> set[signal.Signals | int]:
        """Change the mask, and receive SIGINT in another thread right after."""
        before = change_mask(how, mask)
        other = threading.Thread(target=signal.raise_signal, args=(signal.SIGINT,))
        monkeypatch.setattr(signal, "pthread_sigmask", change_mask)  # a new thread has the mask of this one
        change_mask(signal.SIG_UNBLOCK, {signal.SIGINT})
        other.start()
        change_mask(how, mask)
        other.join()
        return before

    held = []
    former = signal.signal(signal.SIGINT, lambda *_: held.append("delivered"))
    try:
        monkeypatch.setattr(signal, "pthread_sigmask", interrupted)
        with deferred_interrupts():
            held.append("held back")
        assert held == ["held back", "delivered"]
        assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    finally:
        signal.signal(signal.SIGINT, former)

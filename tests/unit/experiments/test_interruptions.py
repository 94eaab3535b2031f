"""Ctrl-C while processes are at work: it is counted, and afterwards all is as before."""

from __future__ import annotations

import signal

import pytest

from aeros.experiments.interruptions import InterruptCounter


def test_each_interrupt_is_counted_and_raises_nothing() -> None:
    former = signal.getsignal(signal.SIGINT)
    with InterruptCounter() as interrupts:
        assert interrupts.count == 0
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        assert interrupts.count == 2
    assert signal.getsignal(signal.SIGINT) is former


def test_the_former_handler_is_back_after_an_exception() -> None:
    former = signal.getsignal(signal.SIGINT)
    with pytest.raises(ZeroDivisionError), InterruptCounter():
        raise ZeroDivisionError
    assert signal.getsignal(signal.SIGINT) is former


def test_an_interrupt_that_is_ignored_stays_ignored() -> None:
    former = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with InterruptCounter() as interrupts:
            signal.raise_signal(signal.SIGINT)
            assert interrupts.count == 0
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, former)

"""A cancellation ends one wait early; without one, waits last as long as they are asked to."""

from __future__ import annotations

from typing import Any

from aeros.agent.execution.cancellable_wait import CancellableWait


class Clock:
    """Runtime on which nothing ends before a time."""

    def __init__(self, ends_at: float = 100.0) -> None:
        self.time = 0.0
        self.ends_at = ends_at
        self.waits = 0

    def now(self) -> float:
        return self.time

    def wait(self, until: float) -> Any:
        self.waits += 1
        self.time = min(until, self.ends_at)
        return "ended" if self.time >= self.ends_at else None


def waiting(runtime: Any) -> Any:
    return CancellableWait(runtime)


def test_without_a_client_the_wait_is_one() -> None:
    runtime = Clock()
    assert waiting(runtime).until(5.0) is None
    assert (runtime.time, runtime.waits) == (5.0, 1)


def test_a_cancellation_ends_the_wait_within_an_interval() -> None:
    runtime = Clock()
    wait = waiting(runtime)
    wait.is_cancelled = lambda: runtime.time >= 1.0
    assert wait.until(5.0) is None
    assert wait.was_cancelled
    assert 1.0 <= runtime.time < 1.2


def test_a_later_wait_lasts_so_that_cancelled_steps_can_end() -> None:
    runtime = Clock(ends_at=3.0)
    wait = waiting(runtime)
    wait.is_cancelled = lambda: True
    assert wait.until(5.0) is None
    assert wait.until(5.0) == "ended"


def test_a_step_that_ends_and_a_time_that_passes_end_the_wait() -> None:
    runtime = Clock(ends_at=2.0)
    wait = waiting(runtime)
    wait.is_cancelled = lambda: False
    assert wait.until(1.0) is None
    assert runtime.time == 1.0
    assert wait.until(5.0) == "ended"
    assert not wait.was_cancelled

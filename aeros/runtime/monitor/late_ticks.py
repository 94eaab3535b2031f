"""Count control ticks that come late on plants that run in real time, and bound them.

A simulated plant waits for the monitor. A robot does not: while the monitor is not asked, the robot moves
unwatched. So the time between two ticks with a motion under way is measured on the wall clock.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from aeros.spec.model.motion import LateTicks

LATE_TICKS: Final = "late-ticks"
"""Name under which the robot is stopped whose ticks come too late."""


class LateTickCounter:
    """Counter of late ticks.

    Args:
        limits: of the site.
        clock: wall clock that never goes back, s.

    Attributes:
        count: late ticks so far.
        longest: longest time between two ticks so far, s.
    """

    def __init__(self, limits: LateTicks, clock: Callable[[], float] | None = None) -> None:
        self.count = 0
        self.longest = 0.0
        self._clock = clock or (lambda: time.monotonic())
        self._period = float(limits.period)
        self._longest_allowed = float(limits.longest)
        self._allowed_in_a_row = limits.in_a_row
        self._in_a_row = 0
        self._last: float | None = None

    def restart(self) -> None:
        """Begin anew with the next tick: until then nothing moves."""
        self._last = None
        self._in_a_row = 0

    def tick(self) -> bool:
        """Note a tick.

        Returns:
            True if it, or too many in a row, came later than the site allows: the robot must stop.
        """
        now = self._clock()
        last, self._last = self._last, now
        if last is None:
            return False
        gap = now - last
        self.longest = max(self.longest, gap)
        if gap <= self._period:
            self._in_a_row = 0
            return False
        self.count += 1
        self._in_a_row += 1
        return gap > self._longest_allowed or self._in_a_row > self._allowed_in_a_row

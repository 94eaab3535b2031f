"""Estimate of the controller's clock from the stamps of joint states.

A message cannot arrive before it is stamped. So the greatest difference of stamp and arrival is that of the
message that came fastest, and the clock of the controller shows arrival + difference, less that delay.
Nobody has to set the clocks of two machines alike, and simulated time serves as well at the pace of real
time: at a slower one, joint states seem to be late.
"""

from __future__ import annotations

from math import inf
from typing import Final

_WINDOW: Final = 30.0
"""Time after which the fastest message is sought anew, s: 100 ppm of drift are 3 ms then."""


class ControllerClock:
    """Clock of the controller, as this machine sees it."""

    def __init__(self) -> None:
        self.newest = -inf
        """Stamp of the newest joint states, s."""
        self._recent = self._before = -inf
        self._window_end = -inf

    def note(self, stamp: float, arrival: float) -> bool:
        """Note that joint states have come.

        Args:
            stamp: their stamp, s.
            arrival: on the monotonic clock, s.

        Returns:
            False if they are not newer than the last ones, and do not count.
        """
        if not stamp > self.newest:
            return False
        self.newest = stamp
        if arrival >= self._window_end:
            self._before, self._recent = self._recent, -inf
            self._window_end = arrival + _WINDOW
        self._recent = max(self._recent, stamp - arrival)
        return True

    def read(self, monotonic: float) -> float:
        """Read the clock.

        Args:
            monotonic: time on the monotonic clock, s.

        Returns:
            The time of the controller, s; minus infinity before the first joint states.
        """
        return monotonic + max(self._recent, self._before)

    def age(self, monotonic: float) -> float:
        """Compute the age of the newest joint states.

        Args:
            monotonic: time on the monotonic clock, s.

        Returns:
            The age, s; infinite before the first joint states.
        """
        return inf if self.newest == -inf else self.read(monotonic) - self.newest

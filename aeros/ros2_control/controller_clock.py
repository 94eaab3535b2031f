"""Estimate of the controller's clock from the stamps of joint states.

A message cannot arrive before it is stamped. So the greatest difference of stamp and arrival is that of the
message that came fastest, and the clock of the controller shows arrival + difference, less that delay.
Nobody has to set the clocks of two machines alike, and simulated time serves as well at the pace of real
time: at a slower one, joint states seem to be late.

A stamp far ahead of the clock does not count, as all true ones would seem to be late after it. If there is no
other for a second, the clock has been set, and is estimated anew; joint states have been late until then.
The first stamp counts whatever it is. If it was far ahead, or the clock is set back, all later joint states
are late until their stamps have caught up: plant time never runs backwards.
"""

from __future__ import annotations

from math import inf
from typing import Final

_WINDOW: Final = 30.0
"""Time after which the fastest message is sought anew, s: 100 ppm of drift are 3 ms then."""

_SET_AFTER: Final = 1.0
"""Time for which all stamps are ahead until the clock counts as set anew, s; chosen: longer than a brake."""


class ControllerClock:
    """Clock of the controller, as this machine sees it.

    Args:
        most_ahead: time by which a stamp may be ahead of the clock, s: clocks drift, and the first joint
            states may come later than others.
    """

    def __init__(self, most_ahead: float) -> None:
        self._most_ahead = most_ahead
        self._ahead_since: float | None = None
        self._ahead = -inf
        """Newest stamp that is too far ahead, s."""
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
            False if they do not count: they are not newer than the last ones, or stamped too far ahead.
        """
        if not stamp > self.newest:
            return False
        if self.newest > -inf and stamp > self.read(arrival) + self._most_ahead:
            if not self._is_set(stamp, arrival):
                return False
            self._recent = self._before = self._window_end = -inf
        self._ahead_since = None
        self.newest = stamp
        if arrival >= self._window_end:
            self._before, self._recent = self._recent, -inf
            self._window_end = arrival + _WINDOW
        self._recent = max(self._recent, stamp - arrival)
        return True

    def _is_set(self, stamp: float, arrival: float) -> bool:
        """Tell if only stamps that are too far ahead, each newer than the one before, have come for long."""
        if self._ahead_since is None or stamp <= self._ahead:
            self._ahead_since = arrival
        self._ahead = stamp
        return arrival - self._ahead_since >= _SET_AFTER

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

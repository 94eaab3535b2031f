"""Counts of executed actions for each quota, within its time window. Bounded memory, no clock of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from fractions import Fraction
from math import inf, isfinite, nan
from sys import float_info

from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.model.policy import Quota


class ClockError(Exception):
    """The given time is earlier than a previous one, or not finite: quotas cannot be counted, so deny."""


def clock_denial(wrong: ClockError) -> Decision:
    """Make the decision for a request whose time cannot be used.

    Args:
        wrong: the error that `QuotaUsageCounter` raised.

    Returns:
        A denial with one reason.
    """
    return Decision(DecisionKind.DENY, None, (Reason("AE707", "clock", str(wrong)),))


class TimeWindow:
    """The closed time window of `length` seconds.

    Exact, and fast where rounding cannot matter.

    Attributes:
        surely: a rounded difference below this double is within the window.
        maybe: a rounded difference above this double is outside; in between, `contains_exactly` decides.
            Rounding keeps order, so both comparisons are exact.
    """

    def __init__(self, length: Fraction) -> None:
        self._length = length
        self.surely, above = adjacent_doubles(length)
        self.maybe = min(above, float_info.max)  # -inf, the time of what never happened, is in no window

    def contains(self, earlier: float, later: float) -> bool:
        """Check if two times fall into one window.

        Args:
            earlier: a time, s; `-inf` is in no window.
            later: a time, s, not before `earlier`.

        Returns:
            True if `later` is at most `length` after `earlier`.
        """
        apart = later - earlier
        return apart < self.surely or (apart <= self.maybe and self.contains_exactly(earlier, later))

    def contains_exactly(self, earlier: float, later: float) -> bool:
        """Check as `contains` does, without rounding.

        Args:
            earlier: a finite time, s.
            later: a finite time, s, not before `earlier`.

        Returns:
            True if `later` is at most `length` after `earlier`.
        """
        apart = later - earlier
        if apart == self.surely == self.maybe:
            # Knuth's TwoSum: `apart` and its rounding error add up to the exact difference.
            share = apart - later
            return (later - (apart - share)) - (earlier + share) <= 0.0
        return Fraction(later) - Fraction(earlier) <= self._length


class QuotaUsageCounter:
    """Executed actions by quota. Times are plant seconds and must not go back.

    The window is closed: an action exactly `window_s` seconds ago still counts. At most `max_count` times are
    kept for each quota, because more cannot change a decision.
    Counts start with this object; a restart forgets earlier ones.
    """

    def __init__(self, quotas: Iterable[Quota]) -> None:
        self._quotas = tuple(quotas)
        self._times: dict[str, deque[float]] = {
            quota.id: deque(maxlen=quota.max_count) for quota in self._quotas
        }
        self._windows = [(self._times[quota.id], TimeWindow(quota.window_s)) for quota in self._quotas]
        self._latest = -inf

    def set_quotas(self, quotas: Iterable[Quota]) -> QuotaUsageCounter:
        """Make a counter for other quotas that keeps the counts of those that are equal in both.

        Args:
            quotas: the new quotas.

        Returns:
            The new counter; this one does not change.
        """
        other = QuotaUsageCounter(quotas)
        other._latest = self._latest
        for quota in other._quotas:
            if quota in self._quotas:
                other._times[quota.id].extend(self._times[quota.id])
        return other

    def usage_at(self, now: float) -> Mapping[str, int]:
        """Count the executed actions in the window of each quota that ends now.

        Args:
            now: plant time, s.

        Returns:
            The count by quota id, at most the quota's `max_count`.

        Raises:
            ClockError: `now` is earlier than a previous time, or not finite.
        """
        at = self._drop_expired(now)
        for times, window in self._windows:
            while times and not window.contains(times[0], at):
                times.popleft()
        return {quota: len(times) for quota, times in self._times.items()}

    def count_execution(self, kind: str, now: float) -> None:
        """Count an action whose execution begins now.

        Args:
            kind: its action kind.
            now: plant time, s.

        Raises:
            ClockError: `now` is earlier than a previous time, or not finite.
        """
        at = self._drop_expired(now)
        for quota in self._quotas:
            if kind in quota.kinds:
                self._times[quota.id].append(at)

    def _drop_expired(self, now: float) -> float:
        at = now if type(now) is float else _double(now)
        if not isfinite(at):
            raise ClockError(f"the time {now} is not a valid time")
        if at < self._latest:
            raise ClockError(f"the clock went back from {self._latest:.6g} s to {at:.6g} s")
        self._latest = at
        return at


def _double(now: object) -> float:
    """Convert a number to the double that equals it; return NaN for anything else."""
    try:
        at = float(now) if isinstance(now, int | float) else nan
    except OverflowError:
        return nan
    return at if at == now else nan

"""Recount of a session from its decision records: quota usage, and histories where records determine them.

Until an action has begun, decisions are the only updates of the histories, so the records determine them
exactly. After that control ticks update them too, and ticks are not recorded. A gap, two updates at which
nothing is known, stands for them; a history that is known in spite of the gap is right whatever ticks saw.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from math import inf
from typing import Any

from aeros.runtime.audit.check import Record
from aeros.runtime.canonical_json import decode_value
from aeros.runtime.gate.quotas import ClockError, QuotaUsageCounter
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.model.site import Site

QuotaUsage = Mapping[str, int] | ClockError
"""Used-up count of each quota; or the error if the clock was wrong."""


class SessionState:
    """Quota usage and histories of one session, updated record by record.

    Args:
        site: the site in force when the session opened.
    """

    def __init__(self, site: Site) -> None:
        self._usage = QuotaUsageCounter(site.quotas)
        self._latest = -inf
        self._reset_histories(site)

    def switch_site(self, site: Site) -> None:
        """Switch to the site in force from now on.

        If it is another site, histories start empty, as in `DecisionPipeline`.

        Args:
            site: the site in force.
        """
        if site.digest != self._site.digest:
            self._usage = self._usage.set_quotas(site.quotas)
            self._reset_histories(site)

    @property
    def usage(self) -> QuotaUsageCounter:
        """Counter of the quotas, to go on counting with."""
        return self._usage

    @property
    def histories(self) -> HistoryTracker:
        """Tracker of the histories, to go on updating."""
        return self._histories

    def mark_gap(self) -> None:
        """Mark a gap in the observations: until the next decision, anything may have moved unseen."""
        self._has_gap = True
        self._histories.advance({}, self._latest)

    def usage_at(self, now: Any) -> QuotaUsage | None:
        """Return the quota usage at a time.

        Args:
            now: recorded plant seconds; may be malformed.

        Returns:
            Count by quota, or the `ClockError` if the clock was wrong; None if `now` is not a number.
        """
        if not isinstance(now, int | float):
            return None
        try:
            return self._usage.usage_at(now)
        except ClockError as fault:
            return fault

    def history_mismatch(self, readings: Readings, now: float) -> str | None:
        """Update the histories with the state of a decision, and compare them with the recorded ones.

        Args:
            readings: recorded state, with the recorded histories.
            now: plant seconds.

        Returns:
            The first history that differs, in words; None if all agree.
        """
        names = self._histories.names
        if self._has_gap:
            # The first tick may have been right after the decision before, the last one right before this.
            self._histories.advance({}, self._latest)
            self._histories.advance({}, now)
        self._latest = now
        known = self._histories.update(readings, now)
        for name in sorted(self._recorded & known.keys() if self._has_gap else names):
            recorded = readings.get(name)
            if recorded != known.get(name):
                return (
                    f"the history `{name}` is recorded as {_format_reading(recorded)}, "
                    f"but the earlier decisions give {_format_reading(known.get(name))}"
                )
        return None

    def count_execution(self, kind: Any, now: Any) -> None:
        """Count an action that begins.

        Args:
            kind: recorded action kind; ignored if malformed.
            now: recorded plant seconds; ignored if malformed.
        """
        self._has_gap = True
        # Malformed times and kinds are not counted.
        with suppress(ClockError, TypeError):
            self._usage.count_execution(kind, now)

    def _reset_histories(self, site: Site) -> None:
        self._site = site
        self._histories = HistoryTracker(site)
        self._recorded = _recorded_histories(site)
        self._has_gap = False


def recount_records(records: Iterable[Record], site: Site) -> SessionState:
    """Recount all sessions in `records`, to go on with them after a gap.

    Args:
        records: sound records of one log, in order; the same site must be in force in all of them.
        site: that site.

    Returns:
        Quota usage and histories, with a gap after the last record.
    """
    recount = SessionState(site)
    for record in records:
        details = record["details"]
        if record["event"] == "decision":
            now = decode_value(details["time"])
            recount.history_mismatch(parse_readings(details["state"]), now)
            decided = details["decided"]
            if decided is not None:
                recount.count_execution(decided["kind"], now)
        elif record["event"] == "session-resumed":
            recount.mark_gap()
    recount.mark_gap()
    return recount


def parse_readings(state: Mapping[str, Any]) -> dict[str, Reading]:
    """Decode the readings of a record.

    Args:
        state: `[value, time]` by name.

    Returns:
        Readings by name.
    """
    return {name: Reading(decode_value(value), decode_value(at)) for name, (value, at) in state.items()}


def _recorded_histories(site: Site) -> frozenset[str]:
    """Return the histories that depend on measured variables alone, not on the number of updates."""
    names = frozenset(site.state)
    for history in site.histories:
        read = t.variables_of(history.term).keys()
        if read and read <= names:
            names |= {history.declared.name}
    return names - site.state.keys()


def _format_reading(reading: Reading | None) -> str:
    return "unknown" if reading is None else str(reading.value)

"""What the decisions of a session add up to: the use of quotas, and as much as they say of histories.

Until an action has begun, decisions are the only looks at the state, and histories are exactly what they
add up to.  From then on control ticks look too, of which there is no record: a moment at which nothing is
known stands for them, and a history that is known all the same is so whatever they saw.
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
from aeros.spec.model.model import Site

QuotaUsage = Mapping[str, int] | ClockError
"""By quota, how much of it is used up; or why nothing can be counted."""


class SessionState:
    """Counts for one session, from its beginning; `site` is the one that governs."""

    def __init__(self, site: Site) -> None:
        self._usage = QuotaUsageCounter(site.quotas)
        self._latest = -inf
        self._reset_histories(site)

    def switch_site(self, site: Site) -> None:
        """From now on `site` governs; as `DecisionPipeline` has it, histories of another site begin anew."""
        if site.digest != self._site.digest:
            self._usage = self._usage.set_quotas(site.quotas)
            self._reset_histories(site)

    @property
    def usage(self) -> QuotaUsageCounter:
        """What was counted, to be counted on."""
        return self._usage

    @property
    def histories(self) -> HistoryTracker:
        """The histories, to be looked on with."""
        return self._histories

    def mark_gap(self) -> None:
        """From here up to the next look at the state nobody looked at it, and something may have moved."""
        self._has_begun = True
        self._histories.advance({}, self._latest)

    def usage_at(self, now: Any) -> QuotaUsage | None:
        """What the quotas have counted by then; None where it is no number."""
        if not isinstance(now, int | float):
            return None
        try:
            return self._usage.usage_at(now)
        except ClockError as fault:
            return fault

    def history_mismatch(self, readings: Readings, now: float) -> str | None:
        """Look at the state as it was decided on: which history cannot be what is recorded, and why."""
        names = self._histories.names
        self._latest = now
        if self._has_begun:
            self._histories.advance({}, now)
        known = self._histories.update(readings, now)
        for name in sorted(self._told & known.keys() if self._has_begun else names):
            recorded = readings.get(name)
            if recorded != known.get(name):
                return (
                    f"the history `{name}` is recorded as {_format_reading(recorded)}, "
                    f"and what was decided before it adds up to {_format_reading(known.get(name))}"
                )
        return None

    def count_execution(self, kind: Any, now: Any) -> None:
        """Such an action begins."""
        self._has_begun = True
        # At what is no time, and of what is no kind, nothing is counted.
        with suppress(ClockError, TypeError):
            self._usage.count_execution(kind, now)

    def _reset_histories(self, site: Site) -> None:
        self._site = site
        self._histories = HistoryTracker(site)
        self._told = _recorded_histories(site)
        self._has_begun = False


def recount_records(records: Iterable[Record], site: Site) -> SessionState:
    """What the decisions of `records` add up to, all under `site`, for a session that goes on with them."""
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
    """The readings that a record holds."""
    return {name: Reading(decode_value(value), decode_value(at)) for name, (value, at) in state.items()}


def _recorded_histories(site: Site) -> frozenset[str]:
    """The histories of what is measured and nothing else; others may count the looks themselves."""
    told = frozenset(site.state)
    for one in site.histories:
        read = t.variables_of(one.term).keys()
        if read and read <= told:
            told |= {one.declared.name}
    return told - site.state.keys()


def _format_reading(reading: Reading | None) -> str:
    return "unknown" if reading is None else str(reading.value)

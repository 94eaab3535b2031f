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
from aeros.runtime.canonical_json import restored
from aeros.runtime.gate.quotas import ClockError, Usage
from aeros.runtime.monitor.history import Histories
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Site

Used = Mapping[str, int] | ClockError
"""By quota, how much of it is used up; or why nothing can be counted."""


class Recount:
    """Counts for one session, from its beginning; `site` is the one that governs."""

    def __init__(self, site: Site) -> None:
        self._usage = Usage(site.quotas)
        self._latest = -inf
        self._look_anew(site)

    def follow(self, site: Site) -> None:
        """From now on `site` governs; as `Deciding` has it, histories of another site begin anew."""
        if site.digest != self._site.digest:
            self._usage = self._usage.under(site.quotas)
            self._look_anew(site)

    @property
    def usage(self) -> Usage:
        """What was counted, to be counted on."""
        return self._usage

    @property
    def histories(self) -> Histories:
        """The histories, to be looked on with."""
        return self._histories

    def interrupt(self) -> None:
        """From here up to the next look at the state nobody looked at it, and something may have moved."""
        self._has_begun = True
        self._histories.advance({}, self._latest)

    def used(self, now: Any) -> Used | None:
        """What the quotas have counted by then; None where it is no number."""
        if not isinstance(now, int | float):
            return None
        try:
            return self._usage.count(now)
        except ClockError as fault:
            return fault

    def objection(self, readings: Readings, now: float) -> str | None:
        """Look at the state as it was decided on: which history cannot be what is recorded, and why."""
        names = self._histories.names
        self._latest = now
        if self._has_begun:
            self._histories.advance({}, now)
        known = self._histories.look(readings, now)
        for name in sorted(self._told & known.keys() if self._has_begun else names):
            recorded = readings.get(name)
            if recorded != known.get(name):
                return (
                    f"the history `{name}` is recorded as {_words(recorded)}, "
                    f"and what was decided before it adds up to {_words(known.get(name))}"
                )
        return None

    def executed(self, kind: Any, now: Any) -> None:
        """Such an action begins."""
        self._has_begun = True
        # At what is no time, and of what is no kind, nothing is counted.
        with suppress(ClockError, TypeError):
            self._usage.executed(kind, now)

    def _look_anew(self, site: Site) -> None:
        self._site = site
        self._histories = Histories(site)
        self._told = _told(site)
        self._has_begun = False


def recounted(records: Iterable[Record], site: Site) -> Recount:
    """What the decisions of `records` add up to, all under `site`, for a session that goes on with them."""
    recount = Recount(site)
    for record in records:
        details = record["details"]
        if record["event"] == "decision":
            now = restored(details["time"])
            recount.objection(readings_of(details["state"]), now)
            decided = details["decided"]
            if decided is not None:
                recount.executed(decided["kind"], now)
        elif record["event"] == "session-resumed":
            recount.interrupt()
    recount.interrupt()
    return recount


def readings_of(state: Mapping[str, Any]) -> dict[str, Reading]:
    """The readings that a record holds."""
    return {name: Reading(restored(value), restored(at)) for name, (value, at) in state.items()}


def _told(site: Site) -> frozenset[str]:
    """The histories of what is measured and nothing else; others may count the looks themselves."""
    told = frozenset(site.state)
    for one in site.histories:
        read = t.variables_of(one.term).keys()
        if read and read <= told:
            told |= {one.declared.name}
    return told - site.state.keys()


def _words(reading: Reading | None) -> str:
    return "unknown" if reading is None else str(reading.value)

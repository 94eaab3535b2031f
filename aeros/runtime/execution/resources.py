"""Who holds what of the site's resources: all that a step needs at once, or nothing and a turn in a queue.

A resource has a capacity; whoever needs it takes one of it.  What one needs is granted whole, and only
where nobody who asked earlier and still waits needs any of it too.

- No deadlock: nobody who holds something waits, so there is no circle of such.
- No starvation: what the first who waits needs is granted to nobody else, so it is his once those who
  hold it have released it.  Whoever is next to him in line is then first of those who need theirs.
- Who needs nothing that anybody before him waits for goes ahead: that delays nobody.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping

from aeros.spec.diagnostics.errors import MisuseError


class ResourceQueue:
    """What is held and who waits, each by a number; no clock and no threads of its own.

    waiting: what each of those who wait needs, in the order in which they asked.
    """

    def __init__(self, capacities: Mapping[str, int]) -> None:
        self._capacities = dict(capacities)
        self._held: dict[int, frozenset[str]] = {}
        self.waiting: dict[int, frozenset[str]] = {}

    def set_capacities(self, capacities: Mapping[str, int]) -> None:
        """Other capacities from now on; what is held stays held."""
        self._capacities = dict(capacities)

    def never_available(self, needs: Collection[str]) -> str | None:
        """What of it there is none at all of, so that it could never be granted."""
        return min((name for name in needs if self._capacities.get(name, 0) < 1), default=None)

    def enqueue(self, who: int, needs: Collection[str]) -> None:
        """Wait for one of each of `needs`."""
        if who in self._held or who in self.waiting:
            raise MisuseError(f"{who} has asked before")
        self.waiting[who] = frozenset(needs)

    def grant_ready(self) -> list[int]:
        """Those whose turn it is, in the order they asked in; they hold what they need from now on."""
        if not self.waiting:
            return []
        free = Counter(self._capacities)
        free.subtract(name for needs in self._held.values() for name in needs)
        awaited: set[str] = set()
        granted = []
        for who, needs in list(self.waiting.items()):
            if needs & awaited or any(free[name] < 1 for name in needs):
                awaited |= needs
                continue
            free.subtract(needs)
            self._held[who] = self.waiting.pop(who)
            granted.append(who)
        return granted

    def release(self, who: int) -> None:
        """`who` holds nothing any more and waits for nothing; safe to call twice."""
        self._held.pop(who, None)
        self.waiting.pop(who, None)

    def held_count(self, name: str) -> int:
        """How many of `name` are held."""
        return sum(name in needs for needs in self._held.values())

"""Allocation of the site's resources: a step gets everything it needs at once, or waits in a queue.

A resource has a capacity; a step needs one unit of each of its resources. A step is granted all of them
together, and only if no step that asked earlier and still waits needs any of them.

- No deadlock: a step that holds resources never waits, so there is no circle of waiting steps.
- No starvation: resources that the first waiting step needs are granted to no other step, so it gets them
  once their holders release them. The step behind it is then the first one.
- A step that shares no resource with the steps before it overtakes them, which delays none of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping

from aeros.spec.diagnostics.errors import MisuseError


class ResourceQueue:
    """Held resources and waiting steps, each step identified by a number. No clock, no threads.

    Attributes:
        waiting: needs of each waiting step, in the order in which they asked.
    """

    def __init__(self, capacities: Mapping[str, int]) -> None:
        self._capacities = dict(capacities)
        self._held: dict[int, frozenset[str]] = {}
        self.waiting: dict[int, frozenset[str]] = {}

    def set_capacities(self, capacities: Mapping[str, int]) -> None:
        """Replace the capacities; held resources stay held.

        Args:
            capacities: number of units, by resource.
        """
        self._capacities = dict(capacities)

    def never_available(self, needs: Collection[str]) -> str | None:
        """Find a needed resource that does not exist here, so that it could never be granted.

        Args:
            needs: resources by name.

        Returns:
            The first such name in alphabetical order; None if all exist.
        """
        return min((name for name in needs if self._capacities.get(name, 0) < 1), default=None)

    def enqueue(self, step: int, needs: Collection[str]) -> None:
        """Add a step to the queue.

        Args:
            step: number of the step.
            needs: resources of which it needs one unit each.

        Raises:
            MisuseError: the step waits or holds resources already.
        """
        if step in self._held or step in self.waiting:
            raise MisuseError(f"step {step} waits or holds resources already")
        self.waiting[step] = frozenset(needs)

    def grant_ready(self) -> list[int]:
        """Grant resources to every waiting step whose turn it is.

        Returns:
            Numbers of the steps that hold their resources from now on, in the order in which they asked.
        """
        if not self.waiting:
            return []
        free = Counter(self._capacities)
        free.subtract(name for needs in self._held.values() for name in needs)
        awaited: set[str] = set()
        granted = []
        for step, needs in list(self.waiting.items()):
            if needs & awaited or any(free[name] < 1 for name in needs):
                awaited |= needs
                continue
            free.subtract(needs)
            self._held[step] = self.waiting.pop(step)
            granted.append(step)
        return granted

    def release(self, step: int) -> None:
        """Release everything a step holds and remove it from the queue; safe to call twice.

        Args:
            step: number of the step.
        """
        self._held.pop(step, None)
        self.waiting.pop(step, None)

    def held_count(self, name: str) -> int:
        """Count the steps that hold a resource.

        Args:
            name: the resource.

        Returns:
            Number of held units.
        """
        return sum(name in needs for needs in self._held.values())
